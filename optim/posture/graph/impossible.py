"""Why no drive was found over a grid, and whether that is proved.

A posture that ends in a numerical status (NOT_CONVERGED, HOLLOW_GROUND, NO_SOLUTION, NON_FINITE) is
not known to be impossible: none was found there, with this solver. So no path is proved to exist
only if there is none even where all such postures are let pass.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import maximum_filter

from stickslip.dynamics.status import Status
from stickslip.optim.posture.stations.station import PLACED
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from jaxtyping import Bool

    from stickslip.optim.posture.graph.posture_grid import PostureGrid


def unsound(grid: PostureGrid, k: int) -> Bool[np.ndarray, "n"]:
    """Which nodes of waypoint k have no pose or no finite forces, and so say nothing."""
    return ~grid.layer(k).met["pose"]


def judged(grid: PostureGrid, reason: str) -> tuple[OptimStatus, str]:
    """INFEASIBLE and the reason where that is proved, else FAILED and what leaves it open.

    reason: why no path over the admissible postures was found.
    """
    K = len(grid.problem.x)
    doubtful = [k for k in range(K) if np.any(unsound(grid, k))]
    stuck = _first_unreached(grid, hopeful=False)
    if stuck is not None and (not doubtful or _first_unreached(grid, hopeful=True) is not None):
        return OptimStatus.INFEASIBLE, reason
    if not doubtful:
        return OptimStatus.FAILED, "the criterion is not finite on any path over the grid"
    at = stuck if stuck in doubtful else doubtful[0]
    return OptimStatus.FAILED, f"not proved infeasible: {_without_numbers(grid, at)}"


def judged_at(grid: PostureGrid, k: int, reason: str) -> tuple[OptimStatus, str]:
    """The same of one waypoint that has no admissible posture, whatever comes before it."""
    if not np.any(unsound(grid, k)):
        return OptimStatus.INFEASIBLE, reason
    return OptimStatus.FAILED, f"not proved infeasible: {_without_numbers(grid, k)}"


def _first_unreached(grid: PostureGrid, hopeful: bool) -> int | None:
    """The first waypoint without a path to it; hopeful: through postures that say nothing, too."""

    def passable(k: int) -> np.ndarray:
        good = grid.admissible(k)
        return good | unsound(grid, k) if hopeful else good

    first, last = grid.free
    windows = grid.windows()
    reached = passable(0)
    for k in range(len(grid.problem.x)):
        if k > 0 and first < k < last:
            size = 2 * windows[k - 1] + 1
            plane = reached.reshape(grid.shape).astype(np.uint8)
            spread = maximum_filter(plane, tuple(size), mode="constant")
            reached = (spread.reshape(-1) > 0) & passable(k)
        elif k > 0:  # from or to a given pair
            a, b = (grid.layer(at).stations.leg_angles for at in (k - 1, k))
            moves = grid.within(k - 1, a[reached][:, None], b)
            reached = np.any(moves, axis=0) & passable(k)
        if not np.any(reached):
            return k
    return None


def _without_numbers(grid: PostureGrid, k: int) -> str:
    """How many postures of a waypoint ended with which status, in words."""
    bad = unsound(grid, k)
    status = grid.layer(k).stations.status[bad]
    codes = np.where(np.isin(status, PLACED), int(Status.NON_FINITE), status)
    counts = Counter(Status(int(code)).name for code in codes)
    listed = ", ".join(f"{n} {name}" for name, n in counts.most_common())
    where = f"at waypoint {k} (x = {grid.problem.x[k]:.6g} m)"
    what = "no posture found: hollow ground" if set(counts) == {"HOLLOW_GROUND"} else "no pose"
    if not np.all(bad):
        what = f"{what} for some pairs of angles" if what == "no pose" else what
    return f"{what} {where}: {int(np.sum(bad))} of {bad.size} pairs of angles ended {listed}"
