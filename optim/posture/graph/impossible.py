"""The result where no path over a grid was found: why, and whether that proves anything."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.status import Status
from stickslip.optim.posture.result import PostureResult
from stickslip.optim.posture.stations.station import PLACED
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from stickslip.optim.posture.graph.posture_grid import PostureGrid


def without_path(grid: PostureGrid, k: int, reason: str, common: dict[str, Any]) -> PostureResult:
    """The result where no path leads to waypoint k. common: fields of every result.

    INFEASIBLE where the problem leaves one pair of angles at k, and that breaks a constraint. Else
    FAILED: there are angles off the grid, and a posture that ends in a numerical status
    (NOT_CONVERGED, HOLLOW_GROUND, NO_SOLUTION, NON_FINITE) is not known to be impossible.
    """
    layer = grid.layer(k)
    doubtful = ~layer.met["pose"]
    status, message = OptimStatus.FAILED, f"no {grid.what}: {reason}"
    if np.any(doubtful):
        message += f"; {_without_numbers(grid, k, doubtful)}"
    elif len(doubtful) == 1 and not layer.admissible[0]:
        status, message = OptimStatus.INFEASIBLE, f"infeasible: {reason}"
    return PostureResult.without_point(status=status, message=message, **common)


def _without_numbers(grid: PostureGrid, k: int, bad: np.ndarray) -> str:
    """Number of postures of a waypoint with each status, as text."""
    status = grid.layer(k).stations.status[bad]
    codes = np.where(np.isin(status, PLACED), int(Status.NON_FINITE), status)
    counts = Counter(Status(int(code)).name for code in codes)
    listed = ", ".join(f"{n} {name}" for name, n in counts.most_common())
    what = "hollow ground" if set(counts) == {"HOLLOW_GROUND"} else "no pose"
    return f"{what}: {int(np.sum(bad))} of {bad.size} pairs of angles there ended {listed}"
