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
"""Relative rounding error of the value."""
ROUNDINGS = 4 * float(np.finfo(float).eps)
"""Rounding error relative to the vehicle's weight."""
NOTHING = 1e-12
"""Difference that counts as zero, relative to the vehicle's weight."""


def closes(problem: PostureProblem, value: float, bound: float | None, relative: float) -> bool:
    """True if a bound leaves at most `relative` of the value open, or next to nothing of what the
    vehicle's weight would give: a value near 0 is no smaller unit."""
    if bound is None:
        return False
    return value - bound <= relative * abs(value) + NOTHING * natural(problem, problem.criterion)


def natural(problem: PostureProblem, criterion: Criterion | Weighted) -> float:
    """Natural scale from the vehicle's weight, in the criterion's unit."""
    if isinstance(criterion, Weighted):
        return sum(float(weight) * natural(problem, one) for one, weight in criterion.parts)
    weight, length = float(problem.params.weight), float(problem.x[-1] - problem.x[0])
    torque = weight * float(problem.params.wheel_radius)
    of = {"J": weight * length, "N m": torque, "N^2 m": torque**2 / length, "N": weight}
    return of.get(criterion.unit, 1.0)


def below(problem: PostureProblem, value: float, criterion: Criterion | Weighted | None = None):
    """A number that the exact value is not below, where `value` was computed."""
    return value - slack(problem, value, problem.criterion if criterion is None else criterion)


def slack(problem: PostureProblem, value: float, criterion: Criterion | Weighted) -> float:
    """Rounding error of a drive's computed value, in the criterion's unit."""
    if isinstance(criterion, Weighted):
        parts = ((one, float(weight)) for one, weight in criterion.parts)
        return sum(w * slack(problem, abs(value) / w, one) for one, w in parts if w > 0)
    absolute = ROUNDINGS * natural(problem, criterion)
    if criterion.unit == "N^2 m":
        # Of a sum of (dM)^2 / dx, each M being off by `torque`, by Cauchy and Schwarz.
        torque = ROUNDINGS * float(problem.params.weight) * float(problem.params.wheel_radius)
        length = float(problem.x[-1] - problem.x[0])
        least_step = float(np.min(np.diff(problem.x)))
        rest = torque * length / least_step
        absolute = (2 * np.sqrt(abs(value) * length) + rest) * torque / least_step
    elif criterion.unit == "-":
        absolute *= 1 + value * value
    return RELATIVE * abs(value) + float(absolute)
