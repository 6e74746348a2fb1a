"""Branch and bound over cells of leg angles: a drive, and what no drive can beat."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics.checks import shown
from stickslip.optim.posture.bounds.branch import (
    CELLS,
    CORNERS,
    bound_every_drive,
    require_boundable,
)
from stickslip.optim.posture.finish import result_at
from stickslip.optim.posture.graph.dp import solve_dp
from stickslip.optim.posture.result import PostureResult
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.posture.problem import PostureProblem


def solve_branch(
    problem: PostureProblem,
    *,
    progress: bool = False,
    tolerance: float = 0.02,
    cells: int = CELLS,
    most_corners: int = CORNERS,
    start: Float[np.ndarray, "n"] | None = None,
) -> PostureResult:
    """The best drive known, and a bound for every drive: on a grid of leg angles or off it.

    start: the drive [2K]; None: that of dp, polished by scp. The lower bound is that of
    `bound_every_drive`, whose options tolerance, cells and most_corners are. OPTIMAL where the gap
    is within the tolerance, else FEASIBLE; INFEASIBLE where it proves that no drive meets the
    constraints. details: gap (of the value), levels (width of cells, bound, share of cells left).
    evaluations: of the drive's own method.
    """
    began = time.perf_counter()
    require_boundable(problem)
    if start is None:
        drive = solve_dp(problem, progress=progress, polish=True)
    else:
        if isinstance(start, str):
            raise ValueError(f"start = {shown(start)}; accepted: None, or a drive's angles [2K]")
        x = problem.batch([start])[0]
        drive = result_at(
            problem, x, method="branch", status=OptimStatus.FEASIBLE, began=began, evaluations=1
        )
    found = bound_every_drive(
        problem,
        drive.x if drive.feasible else None,
        tolerance=tolerance,
        cells=cells,
        most_corners=most_corners,
        progress=progress,
    )
    details = {"gap": found.gap, "levels": [vars(level) for level in found.levels]}
    if found.value == float("inf"):
        return PostureResult.without_point(
            method="branch",
            status=OptimStatus.INFEASIBLE,
            began=began,
            message="no drive meets the constraints, on a grid or off",
            evaluations=drive.evaluations,
            details=details,
        )
    status, message = drive.status, f"no drive found: {drive.message}"
    if drive.feasible:
        closed = found.gap <= tolerance
        status = OptimStatus.OPTIMAL if closed else OptimStatus.FEASIBLE
        message = f"within {found.gap:.2%} of the best that any drive can do"
    return replace(
        drive,
        method="branch",
        status=status,
        lower_bound=min(found.value, drive.value),
        seconds=time.perf_counter() - began,
        message=message,
        details=details,
    )
