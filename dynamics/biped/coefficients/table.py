"""M, P, Y as piecewise polynomials on the support phase: the same functions, several times cheaper.

The slopes are interpolated at Chebyshev nodes in every piece and integrated, so that dM is exactly
the derivative of M inside a piece, and single precision keeps its digits in both. Beyond the ends
of the support phase the outermost pieces go on for one more length, which is what locating the
exchange needs; farther out the values stay what they are there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.coefficients.inertia import (
    GroundMoment,
    ReducedInertia,
    ground_moment,
    inertia_and_moment,
    reduced_inertia,
)
from stickslip.dynamics.biped.links import SUPPORT_END, SUPPORT_START
from stickslip.dynamics.checks import require_integer
from stickslip.dynamics.pytrees import register_pytree

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped.params import BipedParams


@dataclass(frozen=True)
class Table:
    """Piecewise polynomials: number of pieces and degree. Static and hashable.

    With 32 pieces of degree 7 the default robot's values are good to 2e-10 and slopes to 2e-8, in
    SI units and float64.
    """

    pieces: int = 32
    degree: int = 7

    def __post_init__(self):
        for name, low, high in (("pieces", 1, 4096), ("degree", 2, 12)):
            accepted = f"an integer from {low} to {high}"
            require_integer(name, getattr(self, name), low=low, high=high, accepted=accepted)


@register_pytree
@dataclass(frozen=True)
class ExactInertia:
    """The reference: exact functions of the crank angle, from the linkage at every call."""

    params: BipedParams

    def at(self, theta: Float[Array, ""]) -> ReducedInertia:
        """M, P, Y and slopes at `theta` [rad]."""
        return reduced_inertia(self.params, theta)

    def moment_at(self, theta: Float[Array, ""]) -> GroundMoment:
        """Terms of the ground's moment about the ankle at `theta` [rad]."""
        return ground_moment(self.params, theta)

    def spin_at(self, theta: Float[Array, ""]) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """L and its slope alone, at `theta` [rad]."""
        return ground_moment(self.params, theta)[:2]


@register_pytree
@dataclass(frozen=True)
class TableInertia:
    """Coefficients by rising power of the position in [-1, 1] within a piece."""

    momenta: Float[Array, "pieces 3 powers"]
    """M, P, Y"""
    moments: Float[Array, "pieces 3 powers"]
    """L and the mass moments sum m X, sum m y"""

    def at(self, theta: Float[Array, ""]) -> ReducedInertia:
        """M, P, Y and slopes at `theta` [rad]."""
        (M, P, Y), (dM, dP, dY) = _evaluate(self.momenta, theta)
        return ReducedInertia(M, dM, P, dP, Y, dY)

    def moment_at(self, theta: Float[Array, ""]) -> GroundMoment:
        """Terms of the ground's moment about the ankle at `theta` [rad]."""
        (L, X, Y), (dL, _, _) = _evaluate(self.moments, theta)
        return GroundMoment(L, dL, X, Y)

    def spin_at(self, theta: Float[Array, ""]) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """L and its slope alone, at `theta` [rad]."""
        (L,), (dL,) = _evaluate(self.moments[:, :1], theta)
        return L, dL


def fit_table(params: BipedParams, table: Table) -> TableInertia:
    """Build the table from the exact functions; pure, so that vmapped parameters fit their own."""
    width = (SUPPORT_END - SUPPORT_START) / table.pieces
    dtype = jnp.result_type(*map(jnp.result_type, jax.tree.leaves(params)))
    nodes, to_powers = _nodes_and_transform(table.degree)
    middles = SUPPORT_START + width * (np.arange(table.pieces) + 0.5)
    angles = middles[:, None] + width / 2 * np.append(nodes, 0.0)
    inertia, moment = jax.vmap(jax.vmap(lambda angle: inertia_and_moment(params, angle)))(
        jnp.asarray(angles, dtype)
    )

    counts = jnp.arange(1, table.degree + 1, dtype=dtype)

    def powers(
        value: Float[Array, "pieces nodes"], slope: Float[Array, "pieces nodes"]
    ) -> Float[Array, "pieces powers"]:
        """Integrate the interpolated slope; the constant is the value at the piece's middle."""
        rising = slope[:, :-1] @ jnp.asarray(to_powers.T, dtype) * dtype.type(width / 2)
        return jnp.concatenate([value[:, -1:], rising / counts[None]], -1)

    momenta = [(inertia.M, inertia.dM), (inertia.P, inertia.dP), (inertia.Y, inertia.dY)]
    moments = [(moment.L, moment.dL), (moment.X, inertia.P), (moment.Y, inertia.Y)]
    return TableInertia(
        *(
            jnp.stack([powers(*pair) for pair in pairs], axis=1).astype(dtype)
            for pairs in (momenta, moments)
        )
    )


@lru_cache
def _nodes_and_transform(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Chebyshev nodes for the slope, and the matrix from its values there to its powers."""
    nodes = np.cos((np.arange(degree) + 0.5) * np.pi / degree)
    return nodes, np.linalg.inv(np.vander(nodes, increasing=True))


def _evaluate(
    coefficients: Float[Array, "pieces n powers"], theta: Float[Array, ""]
) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """Values and slopes of the n polynomials of one table at `theta` (Horner's rule)."""
    pieces, _, powers = coefficients.shape
    scale = pieces / (SUPPORT_END - SUPPORT_START)
    place = (theta - SUPPORT_START) * scale
    piece = jnp.clip(jnp.floor(place), 0, pieces - 1)
    row = coefficients[piece.astype(jnp.int32)]
    u = jnp.clip(2 * (place - piece) - 1, -3.0, 3.0)
    value, slope = row[:, powers - 1], jnp.zeros_like(row[:, 0])
    for k in range(powers - 2, -1, -1):
        slope = slope * u + value
        value = value * u + row[:, k]
    return value, slope * (2 * scale)
