"""M, P, Y as one Chebyshev series each over the support phase, beside the piecewise table.

One series of high degree needs no piece to be looked up, but every one of its terms: measured
beside the table in `python -m benchmarks.tradeoff`.
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
    inertia_and_moment,
)
from stickslip.dynamics.biped.links import SUPPORT_END, SUPPORT_START
from stickslip.dynamics.checks import require_integer
from stickslip.dynamics.numeric import float_type
from stickslip.dynamics.pytrees import register_pytree

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped.params import BipedParams


@dataclass(frozen=True)
class Chebyshev:
    """Chebyshev series of the given degree. Static and hashable."""

    degree: int = 48

    def __post_init__(self):
        accepted = "an integer from 4 to 256"
        require_integer("degree", self.degree, low=4, high=256, accepted=accepted)


@register_pytree
@dataclass(frozen=True)
class SeriesInertia:
    """Chebyshev coefficients of values and slopes, by rising degree; slopes by the crank angle."""

    momenta: Float[Array, "degrees 6"]
    """M, P, Y and their slopes"""
    moments: Float[Array, "degrees 4"]
    """L, its slope, and the mass moments sum m X, sum m y"""

    def at(self, theta: Float[Array, ""]) -> ReducedInertia:
        """M, P, Y and slopes at `theta` [rad]; along a straight line beyond the series' reach."""
        (*values, dM, dP, dY), beyond = _clenshaw(self.momenta, theta)
        slopes = (dM, dP, dY)
        M, P, Y = (value + slope * beyond for value, slope in zip(values, slopes, strict=True))
        return ReducedInertia(M, dM, P, dP, Y, dY)

    def moment_at(self, theta: Float[Array, ""]) -> GroundMoment:
        """Terms of the ground's moment about the ankle at `theta` [rad]."""
        return GroundMoment(*_clenshaw(self.moments, theta)[0])

    def spin_at(self, theta: Float[Array, ""]) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """L and its slope alone, at `theta` [rad]."""
        L, dL = _clenshaw(self.moments[:, :2], theta)[0]
        return L, dL


def fit_series(params: BipedParams, spec: Chebyshev) -> SeriesInertia:
    """Interpolate the slopes at Chebyshev nodes, integrate; pure: vmapped robots fit their own."""
    dtype = float_type(params)
    nodes, transform, integrate = _transform(spec.degree)
    half = (SUPPORT_END - SUPPORT_START) / 2
    angles = jnp.asarray(SUPPORT_START + half * (1 + nodes), dtype)
    inertia, moment = jax.vmap(lambda angle: inertia_and_moment(params, angle))(angles)
    to_slope = jnp.asarray(transform, dtype)
    to_value = jnp.asarray(half * integrate, dtype)

    def coefficients(
        values: tuple[Float[Array, " nodes"], ...], slopes: tuple[Float[Array, " nodes"], ...]
    ) -> tuple[Float[Array, "nodes k"], Float[Array, "nodes k"]]:
        """Series of the values: integrated slopes, with the constant that fits the values' mean."""
        fitted = to_slope @ jnp.stack(slopes, axis=1)
        raised = to_value @ fitted
        return raised.at[0].set((to_slope @ jnp.stack(values, axis=1))[0]), fitted

    value, slope = coefficients(
        (inertia.M, inertia.P, inertia.Y), (inertia.dM, inertia.dP, inertia.dY)
    )
    turn, turn_slope = coefficients(
        (moment.L, moment.X, moment.Y), (moment.dL, inertia.P, inertia.Y)
    )
    moments = jnp.stack([turn[:, 0], turn_slope[:, 0], turn[:, 1], turn[:, 2]], axis=1)
    return SeriesInertia(
        jnp.concatenate([value, slope], axis=1).astype(dtype), moments.astype(dtype)
    )


@lru_cache
def _transform(degree: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes; values there to Chebyshev coefficients; coefficients to those of the integral."""
    count = degree + 1
    angles = (np.arange(count) + 0.5) * np.pi / count
    orders = np.arange(count)
    transform = 2 / count * np.cos(np.outer(orders, angles))
    transform[0] /= 2
    integrate = np.zeros((count, count))
    for k in range(1, count):  # the integral of T_j is T_{j+1}/(2(j+1)) - T_{j-1}/(2(j-1))
        integrate[k, k - 1] = (2 if k == 1 else 1) / (2 * k)
        if k + 1 < count:
            integrate[k, k + 1] = -1 / (2 * k)
    return np.cos(angles), transform, integrate


def _clenshaw(
    coefficients: Float[Array, "degrees k"], theta: Float[Array, ""]
) -> tuple[Float[Array, " k"], Float[Array, ""]]:
    """Sums of the series at `theta` (Clenshaw's recurrence), and how far beyond its reach that is
    [rad]: there they are those of its reach's end.

    A trial step may end far behind the support phase, where terms of high degree grow without
    bound. Within 4.5 / degree^2 of the interval's half none exceeds cosh(3) = 10.
    """
    half = (SUPPORT_END - SUPPORT_START) / 2
    reach = 1 + 4.5 / (len(coefficients) - 1) ** 2
    place = (theta - SUPPORT_START) / half - 1
    u = jnp.clip(place, -reach, reach)

    def term(carry: tuple[Float[Array, " k"], Float[Array, " k"]], row: Float[Array, " k"]):
        later, latest = carry
        return (row + 2 * u * later - latest, later), None

    zero = jnp.zeros_like(coefficients[0])
    (first, second), _ = jax.lax.scan(term, (zero, zero), coefficients[:0:-1])
    return coefficients[0] + u * first - second, half * (place - u)
