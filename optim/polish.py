"""What a grid's path becomes off the grid: `scp` from there, the bound kept for what it bounds."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

from stickslip.dynamics.checks import require_memory
from stickslip.optim.result import OptimStatus, Result
from stickslip.optim.sizes import CONVEX

if TYPE_CHECKING:
    from stickslip.optim.problem import PostureProblem

ON_GRID = ("grid", "dp", "lp")
"""The methods whose paths a polish follows."""
BETTER = 1e-9
"""Relative decrease below which a polished drive is no better than the grid's."""


def require_room(problem: PostureProblem) -> None:
    """Refuse what the polish has no room for, before the grid is searched."""
    K = len(problem.x)
    require_memory(f"polish = True with {K} waypoints", "rows of a convex program", K, CONVEX)


def polished(problem: PostureProblem, found: Result, progress: bool) -> Result:
    """The better of a grid's result and of the local optimum that scp finds from it.

    Off the grid the status is FEASIBLE, since the bound is of paths over the grid alone: it stays,
    with what it bounds, and a drive off the grid may be below it. details: grid_value and
    grid_angles, of the grid's path; polish, how scp ended. Without a path nothing is polished.
    """
    if found.x is None:
        return found
    from stickslip.optim.scp import solve_scp

    began = time.perf_counter()
    local = solve_scp(problem, start=found.x, progress=progress)
    details = dict(found.details) | {
        "grid_value": found.value,
        "grid_angles": found.leg_angles,
        "polish": f"{local.status.name}: {local.message}",
    }
    seconds = found.seconds + time.perf_counter() - began
    least = found.value - BETTER * (1 + abs(found.value))
    if not local.feasible or (found.feasible and not local.value < least):
        return replace(found, details=details, seconds=seconds)
    stuck = f" {found.message}" if found.message.startswith("In ") else ""
    return replace(
        local,
        method=found.method,
        status=OptimStatus.FEASIBLE,
        lower_bound=found.lower_bound,
        bound_of=found.bound_of,
        evaluations=found.evaluations,
        seconds=seconds,
        message=f"a local optimum off the grid, by scp ({local.message}), from the grid's path, "
        f"whose value is {found.value:.8g}.{stuck}",
        details=details,
    )
