"""Cost of a step: terms of products of fields at its ends, and linear functions below them.

A term of a step from a to b is max(0, p), p = (X_a + X_b) (Y_b - Y_a) / 2: torque and turn of the
wheels, or of a leg; or p^2 / dx, p = X_b - X_a, where Y is None. Both lie above

    s p, s from 0 to 1,    or    (2 s p - s^2) / dx, any s,

and the best s, the slope, gives them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.optim.posture.criteria import Criterion, Weighted

if TYPE_CHECKING:
    from jaxtyping import Float

    Array = Float[np.ndarray, "..."]


class Term(NamedTuple):
    """weight * max(0, p), or weight * p^2 / dx where Y is None."""

    weight: float
    X: str
    Y: str | None

    def cost(self, p: Array, dx: float) -> Array:
        """Cost of the term."""
        return self.weight * (np.maximum(p, 0.0) if self.Y is not None else p**2 / dx)

    def below(self, slope: Array, p: Array, kappa: Array, dx: float) -> tuple[Array, Array]:
        """A function below what is paid, were p less by kappa, either way; its derivative by the
        slope. Concave in it."""
        if self.Y is not None:
            p = p - kappa
            return self.weight * slope * p, self.weight * p
        size, sign = np.abs(slope), np.sign(slope)
        value = (2 * slope * p - 2 * size * kappa - slope**2) / dx
        return self.weight * value, self.weight * 2 * (p - sign * kappa - slope) / dx

    def slopes(self, p: Array) -> tuple[Array, Array]:
        """The least and the largest that may be best; p: [n, corners]."""
        if self.Y is not None:
            return np.zeros(len(p)), np.ones(len(p))
        return np.min(p, axis=1), np.max(p, axis=1)


PAIRS = {
    "wheel_energy": (("torque", "turn"),),
    "total_energy": (("torque", "turn"), ("leg_rear", "rear"), ("leg_front", "front")),
    "torque_variation": (("torque", None),),
}


def terms_of(criterion: Criterion | Weighted) -> list[Term]:
    """The terms of a sum over steps; ValueError for a criterion that has no such form here."""
    parts = criterion.parts if isinstance(criterion, Weighted) else ((criterion, 1.0),)
    found = []
    for one, weight in parts:
        if one.name not in PAIRS:
            raise ValueError(
                f"criterion = {criterion.name}; accepted: {', '.join(PAIRS)}, their weighted sums, "
                "and single worst stations"
            )
        found += [Term(float(np.asarray(weight)), X, Y) for X, Y in PAIRS[one.name]]
    return [term for term in found if term.weight > 0]
