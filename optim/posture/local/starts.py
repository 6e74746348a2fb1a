"""Starting points of gradient methods and sampling methods."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cvxpy as cp
import numpy as np

from stickslip.dynamics.checks import require_choice
from stickslip.optim.cvx import solve_quietly
from stickslip.optim.posture.finish import result_at
from stickslip.optim.posture.local.linearise import Near
from stickslip.optim.posture.result import PostureResult
from stickslip.optim.result import OptimStatus
from stickslip.optim.start import shortcomings

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.posture.problem import PostureProblem

STARTS = ("dp", "grid", "middle")


def start_point(
    problem: PostureProblem, start: Any, angles: Any = None, progress: bool = False
) -> tuple[Float[np.ndarray, "n"], str]:
    """A point to begin from, inside the bounds, and a sentence where it is not what was asked for.

    start: "dp" or "grid", those methods' solutions on the grid of those angles (see build_grid);
    "middle", the middle of the legs' range everywhere; or a decision vector. Where the grid has no
    feasible path, or the criterion is a weighted sum that dp does not take, it is the middle.
    """
    low, high = problem.bounds
    if not isinstance(start, str):
        return np.clip(problem.angles(start).reshape(-1), low, high), ""
    require_choice("start", start, STARTS)
    middle = (low + high) / 2
    if start == "middle":
        return middle, ""
    from stickslip.optim.solving import solve

    if start == "dp" and problem.criterion.kind == "mixed":
        return middle, "began in the middle: dp takes no weighted sum with a worst station in it; "
    found = solve(problem, start, polish=False, progress=progress, angles=angles)
    if found.x is None:
        return middle, f"began in the middle, since {start} found nothing ({found.message}); "
    return np.clip(found.x, low, high), ""


def within_rates(problem: PostureProblem, x: Float[np.ndarray, "n"]) -> np.ndarray | None:
    """x, or the point nearest to it within the bounds and the leg rates; None if there is none."""
    angles = problem.angles(x)
    low, high = (side.reshape(-1, 2) for side in problem.bounds)
    most = np.inf if problem.leg_rate is None else problem.leg_rate * np.diff(problem.x)[:, None]
    inside = np.all((angles >= low) & (angles <= high))
    if inside and np.all(np.abs(np.diff(angles, axis=0)) <= most * (1 + 1e-9)):
        return angles.reshape(-1)
    near = cp.Variable(angles.shape)
    constraints: list[cp.Constraint] = [near >= low, near <= high]
    if problem.leg_rate is not None:
        constraints.append(cp.abs(cp.diff(near, axis=0)) <= most * np.ones(2))
    nearest = cp.Problem(cp.Minimize(cp.sum_squares(near - angles)), constraints)
    if not _joined(problem):
        return None
    if solve_quietly(nearest, cp.CLARABEL).status is not OptimStatus.OPTIMAL:
        return _straight(problem)
    return np.clip(np.asarray(near.value), low, high).reshape(-1)


def _joined(problem: PostureProblem) -> bool:
    """True if the rate lets both legs turn from the given start to the given end: that is all that
    could stand in the way of a point within bounds and rates."""
    if problem.leg_rate is None or problem.start_angles is None or problem.end_angles is None:
        return True
    turn = np.max(np.abs(np.subtract(problem.end_angles, problem.start_angles)))
    return bool(turn <= problem.leg_rate * (problem.x[-1] - problem.x[0]) * (1 + 1e-9))


def _straight(problem: PostureProblem) -> np.ndarray:
    """Angles that change evenly from the given start to the given end, or stay: within the rates
    where any are."""
    ends = [given for given in (problem.start_angles, problem.end_angles) if given is not None]
    middle = (problem.bounds[0][-2:] + problem.bounds[1][-2:]) / 2
    first, last = (ends or [middle])[0], (ends or [middle])[-1]
    part = (problem.x - problem.x[0]) / (problem.x[-1] - problem.x[0])
    return (first + part[:, None] * (last - first)).reshape(-1)


def begin(
    problem: PostureProblem, method: str, start: Any, angles: Any, progress: bool, began: float
) -> tuple[Near, Float[np.ndarray, "n"], str] | PostureResult:
    """Start of a method: the problem's linear models, a point within bounds and leg rates, and
    start_point's sentence. Or the result, where there is no such point, no pose at it, or no
    choice."""
    x, note = start_point(problem, start, angles, progress)
    x = within_rates(problem, x)
    if x is None:
        return PostureResult.without_point(
            method=method, status=OptimStatus.INFEASIBLE, began=began,
            message="leg_rate lets no path lead from start_angles to end_angles in this range",
        )  # fmt: skip
    if problem.free.n == 0:
        return result_at(
            problem, x, method=method, status=OptimStatus.FEASIBLE, began=began, evaluations=1,
            message=f"{note}every angle is given{shortcomings(problem, x)}",
        )  # fmt: skip
    near = Near(problem)
    if near(x).placed:
        return near, x, note
    message = f"{note}where it begins there is no pose, or no forces{shortcomings(problem, x)}"
    return result_at(
        problem, x, method=method, status=OptimStatus.FAILED, began=began, message=message
    )
