"""The chapter's method: all pairs of leg angles at each waypoint, chosen point by point."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from stickslip.dynamics.checks import require_kind
from stickslip.optim.posture.criteria import pointwise_cost
from stickslip.optim.posture.finish import result_at
from stickslip.optim.posture.graph.impossible import without_path
from stickslip.optim.posture.graph.posture_grid import PostureGrid, build_grid
from stickslip.optim.posture.local.polish import polishable
from stickslip.optim.posture.result import PostureResult
from stickslip.optim.posture.rounding import below
from stickslip.optim.posture.stations.station import Station
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from stickslip.optim.posture.problem import PostureProblem


@polishable
def solve_grid(
    problem: PostureProblem,
    *,
    progress: bool = False,
    angles: Any = None,
    within_rate: bool = False,
) -> PostureResult:
    """Choose at each waypoint the admissible pair of leg angles whose own cost is least.

    The chapter's search. A worst-station criterion is judged by the station's cost. Sums over
    steps are not known of one station; in their place stands, for wheel_energy and total_energy,
    |M|, and for torque_variation |M - M'|, M' being the choice before (0 at the first waypoint);
    in weighted sums the weighted sum of these. So nothing says that such a choice is good.

    angles: of the grid, see build_grid; None: fitting_grid, 31 of each leg at least.

    within_rate: choose among the pairs that leg_rate lets the legs reach from the choice before,
    which may end where there is none; without it leg_rate is not looked at, as in the chapter, and
    the result may break it (VIOLATED; its residuals say by how much). For single worst-station
    criteria grid_bound is the largest over the waypoints of the least cost there: no path over the
    grid is below it, within the rate or not. evaluations: stations. details: grid, rate_used (of
    the grid, see build_grid), grid_bound (None for sums).
    """
    began = time.perf_counter()
    require_kind("within_rate", within_rate, bool, "True or False")
    grid = build_grid(problem, angles, method="grid", progress=progress)
    nodes, reason, bound = _choose(grid, within_rate)
    common: dict[str, Any] = {
        "method": "grid",
        "began": began,
        "evaluations": grid.evaluations,
    }
    if reason and np.any(grid.admissible(len(nodes))):
        failed = OptimStatus.FAILED
        return PostureResult.without_point(status=failed, message=reason, **common)
    if reason:
        return without_path(grid, len(nodes), reason, common)
    return result_at(
        problem,
        np.stack([grid.layer(k).stations.leg_angles[node] for k, node in enumerate(nodes)]),
        status=OptimStatus.FEASIBLE,
        message="chosen point by point" + ("" if within_rate else ", leg_rate not looked at"),
        details=grid.details | {"grid_bound": bound},
        **common,
    )


def _choose(grid: PostureGrid, within_rate: bool) -> tuple[list[int], str, float | None]:
    """The node at each waypoint, as far as there is one, why there is none at the next, and the
    grid's bound."""
    criterion = grid.problem.criterion
    before = None
    nodes: list[int] = []
    least = []
    for k in range(len(grid.problem.x)):
        here, good = grid.layer(k).stations, grid.admissible(k)
        if not np.any(good):
            return nodes, grid.why_none(k), None
        cost = np.where(good, _cost(criterion, here, before), np.inf)
        least.append(np.min(cost))
        if within_rate and before is not None:
            reached = grid.within(k - 1, before.leg_angles, here.leg_angles)
            cost = np.where(reached, cost, np.inf)
            if not np.any(np.isfinite(cost)):
                return nodes, _dead_end(grid, k), None
        node = int(np.argmin(cost))
        before = here.map(lambda of, node=node: of[[node]])
        nodes.append(node)
    bound = below(grid.problem, float(np.max(least))) if criterion.kind == "max" else None
    return nodes, "", bound


def _cost(criterion, here: Station, before: Station | None) -> np.ndarray:
    """Each node's own cost [N]; before: the station [1] chosen before it."""
    if before is None:
        before = here.map(lambda of: np.zeros_like(of[:1]))
    with jax.enable_x64(True):
        return np.asarray(_pointwise(criterion, here, before))


_pointwise = jax.jit(pointwise_cost)


def _dead_end(grid: PostureGrid, k: int) -> str:
    left = int(np.sum(grid.admissible(k)))
    return (
        f"dead end: leg_rate = {grid.problem.leg_rate} rad/m lets the pair chosen at waypoint "
        f"{k - 1} move to none of the {left} admissible ones at waypoint {k} (x = "
        f"{grid.problem.x[k]:.6g} m); another choice before may pass: see dp"
    )
