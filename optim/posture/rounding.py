"""Bounds that stay bounds: how far the value of a drive may be off by rounding.

Stations are computed in double precision from the problem's own numbers. Worked out again by other
means (bisection, other equations, other quadrature) torques and turns differ by 1e-15 to 2e-13 of
themselves, on ground 1 km long and 1500 m high, too; next to nothing, by roundings of the
vehicle's weight. A bound that is called proved is lowered by more than both.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.posture.criteria import Criterion, Weighted

if TYPE_CHECKING:
    from stickslip.optim.posture.problem import PostureProblem

RELATIVE = 5e-13
"""Of the value."""
ROUNDINGS = 4 * float(np.finfo(float).eps)
"""Of what the vehicle's weight would give."""


def below(problem: PostureProblem, value: float, criterion: Criterion | Weighted | None = None):
    """A number that the exact value is not below, where `value` was computed."""
    return value - slack(problem, value, problem.criterion if criterion is None else criterion)


def slack(problem: PostureProblem, value: float, criterion: Criterion | Weighted) -> float:
    """How far the computed value of a drive may be above the exact one, in the criterion's unit."""
    if isinstance(criterion, Weighted):
        parts = ((one, float(weight)) for one, weight in criterion.parts)
        return sum(w * slack(problem, abs(value) / w, one) for one, w in parts if w > 0)
    weight, radius = float(problem.params.weight), float(problem.params.wheel_radius)
    length, torque = float(problem.x[-1] - problem.x[0]), ROUNDINGS * weight * radius
    least_step = float(np.min(np.diff(problem.x)))
    absolute = {
        "J": ROUNDINGS * weight * length,
        "N m": torque,
        # Of a sum of (dM)^2 / dx, each M being off by `torque`, by Cauchy and Schwarz.
        "N^2 m": (2 * np.sqrt(abs(value) * length) + torque * length / least_step)
        * torque / least_step,
        "N": ROUNDINGS * weight,
    }.get(criterion.unit, ROUNDINGS * (1 + value * value))  # fmt: skip
    return RELATIVE * abs(value) + float(absolute)
