"""How well the ground grips, place by place."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_increasing, require_number, shown
from stickslip.dynamics.pytrees import Number, Numbers, pytree_dataclass

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Real


@pytree_dataclass
class Surface:
    """Friction coefficient along the ground, relative to the problem's.

    knots: places [n], ascending, two or more [m]. factors: there [n], >= 0 [-]; straight between
    the knots, constant beyond them. Patches are knots in pairs, as far apart as a wheel takes from
    one to the other. A factor is that of the point where a wheel touches. measured: the factors are
    mu itself, whatever the problem's friction; static.
    """

    knots: Real[Array | np.ndarray, "n"]
    factors: Real[Array | np.ndarray, "n"]
    measured: bool = field(default=False, metadata={"static": True})

    @classmethod
    def patches(cls, edges: Numbers, factors: Numbers, ramp: float = 0.05) -> Surface:
        """One factor [n + 1] on each side of the edges [n] [m], straight over a `ramp` about them.

        ValueError for edges that are not further apart than that.
        """
        require_number("edges", edges, accepted="places [m]")
        require_number("factors", factors, low=0.0, accepted="factors >= 0, one more than edges")
        require_number("ramp", ramp, low=0.0, strict=True, accepted="a length > 0 [m]")
        at, of = np.asarray(edges, float), np.asarray(factors, float)
        fitting = np.ndim(ramp) == 0 and at.ndim == 1 and of.shape == (len(at) + 1,)
        if not fitting or np.any(np.diff(at) <= ramp):
            raise ValueError(
                f"edges = {shown(edges)}, factors = {shown(factors)}, ramp = {shown(ramp)}; "
                "accepted: ascending edges further apart than one ramp [m], and one factor more"
            )
        return cls(*pairs(at, of, ramp)).validate()

    def validate(self) -> Surface:
        """Return self, or raise ValueError naming the field."""
        accepted = "ascending places, two or more [m]"
        require_number("knots", self.knots, accepted=accepted)
        require_number("factors", self.factors, low=0.0, accepted="finite factors >= 0")
        shape = np.shape(self.knots)
        if not shape or shape[-1] < 2 or np.shape(self.factors) != shape:
            given = f"knots of shape {shape}, factors of shape {np.shape(self.factors)}"
            raise ValueError(f"{given}; accepted: [n] of each, n >= 2")
        require_increasing("knots", self.knots, accepted)
        return self

    def at(self, x: Real[Number, "..."]) -> Float[Array, "..."]:
        """The factor at each x [m]."""
        x = jnp.asarray(x)
        knots, factors = (jnp.asarray(of, x.dtype) for of in (self.knots, self.factors))
        return jnp.interp(x, knots, factors)

    def mu(self, friction: Any, factors: Any) -> Any:
        """mu where `factors` of the surface are, on a problem with that friction [-]."""
        return factors if self.measured else friction * factors

    def most(self, first: Float[np.ndarray, "n"], last: Float[np.ndarray, "n"]) -> np.ndarray:
        """The greatest factor from each first to each last place [n] [m]; of concrete numbers."""
        knots, factors = np.asarray(self.knots, float), np.asarray(self.factors, float)
        ends = np.maximum(np.interp(first, knots, factors), np.interp(last, knots, factors))
        within = (knots > first[:, None]) & (knots < last[:, None])
        return np.maximum(ends, np.max(np.where(within, factors, 0.0), axis=-1))


def pairs(
    edges: Float[Array | np.ndarray, "n"], factors: Float[Array | np.ndarray, "m"], ramp: Number
) -> tuple[Float[Array, "k"], Float[Array, "k"]]:
    """Knots and factors [2 n] of patches: two knots about each edge."""
    knots = jnp.stack([edges - ramp / 2, edges + ramp / 2], -1)
    return knots.reshape(-1), jnp.stack([factors[:-1], factors[1:]], -1).reshape(-1)
