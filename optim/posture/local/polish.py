"""Improvement of a grid's path off the grid: `scp` from there."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from typing import TYPE_CHECKING, Any

from stickslip.dynamics.checks import require_memory
from stickslip.optim.posture.result import PostureResult
from stickslip.optim.posture.sizes import CONVEX
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from stickslip.optim.posture.problem import PostureProblem

BETTER = 1e-9
"""Relative decrease below which a polished drive is no better than the grid's."""


def polishable(method: Callable[..., PostureResult]) -> Callable[..., PostureResult]:
    """The method of the grid with one more option, polish (False): what `polished` makes of it."""

    @wraps(method)
    def run(
        problem: PostureProblem, *, progress: bool = False, polish: bool = False, **options: Any
    ) -> PostureResult:
        if polish:
            require_room(problem)
        result = method(problem, progress=progress, **options)
        return polished(problem, result, progress) if polish else result

    own = inspect.signature(method)
    more = inspect.signature(run, follow_wrapped=False).parameters["polish"]
    run.__signature__ = own.replace(parameters=[*own.parameters.values(), more])  # type: ignore[attr-defined]
    return run


def require_room(problem: PostureProblem) -> None:
    """Refuse what the polish has no room for, before the grid is searched."""
    K = len(problem.x)
    require_memory(f"polish = True with {K} waypoints", "rows of a convex program", K, CONVEX)


def polished(problem: PostureProblem, grid: PostureResult, progress: bool) -> PostureResult:
    """The better of a grid's result and of the local optimum that scp finds from it.

    details: those of the grid, whose grid_bound a drive off it may be below; grid_value and
    grid_angles, of the grid's path; polish, how scp ended. Without a path nothing is polished.
    """
    if grid.x is None:
        return grid
    from stickslip.optim.posture.local.scp import solve_scp

    began = time.perf_counter()
    local = solve_scp(problem, start=grid.x, progress=progress)
    details = dict(grid.details) | {
        "grid_value": grid.value,
        "grid_angles": grid.leg_angles,
        "polish": f"{local.status.name}: {local.message}",
    }
    seconds = grid.seconds + time.perf_counter() - began
    least = grid.value - BETTER * (1 + abs(grid.value))
    if not local.feasible or (grid.feasible and not local.value < least):
        return replace(grid, details=details, seconds=seconds)
    stuck = f" {grid.message}" if grid.message.startswith("In ") else ""
    return replace(
        local,
        method=grid.method,
        status=OptimStatus.FEASIBLE,
        evaluations=grid.evaluations,
        seconds=seconds,
        message=f"a local optimum off the grid, by scp ({local.message}), from the grid's path, "
        f"whose value is {grid.value:.8g}.{stuck}",
        details=details,
    )
