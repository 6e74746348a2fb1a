"""Choice of a path over the grid: point by point, and by dynamic programming.

The costs of arriving, y, are potentials that bound all paths: y_head <= y_tail + cost for every
edge, so no path costs less than y at its end. That is the dual of the shortest path, without a
linear program.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stickslip.optim.options import float64_program
from stickslip.optim.posture.criteria import (
    Criterion,
    Weighted,
    pointwise_cost,
    station_cost,
    step_cost,
)
from stickslip.optim.posture.graph.grid import LEAST, PostureGrid, build_grid, polished
from stickslip.optim.posture.result import PostureResult, below, closes
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from collections.abc import Iterator

    from jaxtyping import Array, Float, Int

    from stickslip.optim.posture.problem import PostureProblem
    from stickslip.optim.posture.station import Station

AGREEMENT = 1e-8
"""Relative difference of the recursion's value and the objective above which it is no proof."""
OVER_GRID = "proved: the best of all {}, not of all drives"
EDGES = 1 << 18
"""About the number of edges whose costs are computed in one call."""


def solve_grid(
    problem: PostureProblem,
    *,
    progress: bool = False,
    polish: bool = False,
    angles: Any = None,
    least: int = LEAST,
) -> PostureResult:
    """Choose at each waypoint the admissible pair of leg angles whose own cost is least.

    The chapter's search. A worst-station criterion is judged by the station's cost. Sums over
    steps are not known of one station; in their place stands, for wheel_energy and total_energy,
    |M|, and for torque_variation |M - M'|, M' being the choice before (0 at the first waypoint);
    in weighted sums the weighted sum of these. So nothing says that such a choice is good.

    angles, least: of the grid, as in dp. leg_rate is not looked at, as in the chapter, and the
    result may break it (VIOLATED; its residuals say by how much). For single worst-station
    criteria grid_bound is the largest over the waypoints of the least cost there: no path over the
    grid is below it. evaluations: stations. details: grid, rate_used, grid_bound (None for sums).
    polish: see `polished`.
    """

    def search() -> PostureResult:
        grid = build_grid(problem, angles, least, "grid", progress)
        nodes, reason, bound = _choose(grid)
        if reason:
            return grid.without_path(len(nodes), reason)
        message = "chosen point by point, leg_rate not looked at"
        return grid.result(np.array(nodes), OptimStatus.FEASIBLE, message, grid_bound=bound)

    return polished(problem, polish, progress, search)


def _choose(grid: PostureGrid) -> tuple[list[int], str, float | None]:
    """The node at each waypoint, as far as there is one, why there is none at the next, and the
    grid's bound."""
    criterion = grid.problem.criterion
    before = grid.layers[0].stations.map(lambda of: np.zeros_like(of[:1]))
    nodes: list[int] = []
    least = []
    for k, layer in enumerate(grid.layers):
        here, good = layer.stations, layer.admissible
        if not np.any(good):
            return nodes, grid.why_none(k), None
        cost = np.where(good, _pointwise(criterion, here, before), np.inf)
        least.append(np.min(cost))
        nodes.append(int(np.argmin(cost)))
        before = here.map(lambda of, node=nodes[-1]: of[[node]])
    bound = below(grid.problem, float(np.max(least))) if criterion.kind == "max" else None
    return nodes, "", bound


_pointwise = float64_program(pointwise_cost)


def solve_dp(
    problem: PostureProblem,
    *,
    progress: bool = False,
    polish: bool = False,
    angles: Any = None,
    least: int = LEAST,
) -> PostureResult:
    """The exact optimum over paths on a grid of leg angles, evenly spaced for each leg.

    angles: of each leg, an integer or a pair, evenly spaced over its range; None: those of
    fitting_grid, `least` of each leg at least.

    Value iteration forwards over the waypoints: V_k(j) = min over i of V_(k-1)(i) + cost(i, j) for
    criteria that are sums over steps, V_k(j) = min over i of max(V_(k-1)(i), cost(j)) for worst
    stations; i runs over the pairs of angles from which the rate lets both legs arrive. A weighted
    sum is accepted where all its parts are sums over steps. Time: K n^2 w^2, w being the angles
    within reach; without a rate limit w is n, so keep the grid coarse.

    Given start and end angles are nodes of their own, on the grid or not. The grid's bound is the
    value less its rounding and that of the stations (`below`): no path over the grid is better.
    INACCURATE where the objective is not within 1e-8 of the value, nor within 1e-12 of what the
    vehicle's weight would give. It bounds no drive off the grid, so that lower_bound is None;
    `solve(problem, "branch")` has one. FAILED where there is no path over the grid: see
    `without_path`. evaluations: stations. details: grid, rate_used (the share of the leg rate that
    each leg can use on it), grid_bound, edges (moves looked at). polish: see `polished`.
    """
    if problem.criterion.kind == "mixed":
        raise ValueError(
            f"criterion = {problem.criterion.name} holds a worst station; accepted: single "
            "criteria, and weighted sums of sums over steps"
        )

    def search() -> PostureResult:
        grid = build_grid(problem, angles, least, "dp", progress)
        paths = best_paths(grid)
        if paths.nodes is None:
            return grid.without_path(paths.stuck_at, paths.reason)
        return _agreed(
            problem,
            grid.result(
                paths.nodes,
                OptimStatus.FEASIBLE,
                grid.stuck or OVER_GRID.format(grid.what),
                grid_bound=paths.bound(problem),
                edges=paths.edges,
            ),
            paths.value,
        )

    return polished(problem, polish, progress, search)


def _agreed(problem: PostureProblem, result: PostureResult, value: float) -> PostureResult:
    """The result, INACCURATE and without the grid's bound where the objective is not `value`."""
    low, high = sorted((value, result.value))
    if closes(problem, high, low, AGREEMENT):
        return result
    details = {name: of for name, of in result.details.items() if name != "grid_bound"}
    message = f"the objective is {result.value!r} where {value!r} was computed"
    return replace(result, status=OptimStatus.INACCURATE, details=details, message=message)


class Paths(NamedTuple):
    """Outcome of the recursion."""

    values: list[np.ndarray]
    """Least cost of arriving at each node of each waypoint; infinite where none arrives."""
    nodes: np.ndarray | None
    """The best path's node at each waypoint [K]; None where no path arrives."""
    edges: int = 0
    """Number of moves looked at: all that the rate and the constraints allow."""
    stuck_at: int = 0
    """The first waypoint where no path arrives."""
    reason: str = ""
    """Reason why there is none."""

    @property
    def value(self) -> float:
        """Cost of the best path."""
        return float(np.min(self.values[-1]))

    def bound(self, problem: PostureProblem) -> float:
        """A number that no path over the grid is below, whatever its sums and stations round."""
        costs = np.concatenate(self.values)
        size = float(np.max(np.abs(costs[np.isfinite(costs)]), initial=0.0))
        rounding = 4 * np.finfo(float).eps * size * (len(self.values) + 1)
        return below(problem, self.value - rounding)


def best_paths(grid: PostureGrid) -> Paths:
    """The recursion over all waypoints, and the best path's nodes."""
    K, count = len(grid.layers), 0
    costs, back = [_first_costs(grid)], []
    for step in range(K - 1):
        cost, came, edges = _arrive(grid, step, costs[-1])
        costs.append(cost)
        back.append(came)
        count += edges
    for k, of in enumerate(costs):
        if not np.any(np.isfinite(of)):
            return Paths(costs, None, count, k, grid.why_stuck(k))
    nodes = np.zeros(K, dtype=int)
    nodes[-1] = np.argmin(costs[-1])
    for k in range(K - 1, 0, -1):
        nodes[k - 1] = back[k - 1][nodes[k]]
    return Paths(costs, nodes, count)


def _first_costs(grid: PostureGrid) -> np.ndarray:
    """The cost of beginning at each node of the first waypoint."""
    begin, criterion = grid.layers[0], grid.problem.posture.criterion
    cost = np.zeros(len(begin.admissible))
    if criterion.kind == "max":
        cost = station_costs(criterion, begin.stations)
    return np.where(begin.admissible, cost, np.inf)


def _arrive(grid: PostureGrid, step: int, before: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Least costs of arriving at the next waypoint's nodes, the nodes before, and the number of
    moves; of equally good moves the first one in the order of `PostureGrid.edges`."""
    join = np.maximum if grid.problem.criterion.kind == "max" else np.add
    size, count = len(grid.layers[step + 1].admissible), 0
    best, came = np.full(size, np.inf), np.zeros(size, dtype=int)
    for tail, head, cost in costed_edges(grid, step):
        total = join(before[tail], cost)
        total = np.where(np.isnan(total), np.inf, total)
        last = best.copy()
        np.minimum.at(best, head, total)
        better = np.flatnonzero((total == best[head]) & (total < last[head]))[::-1]
        came[head[better]] = tail[better]
        count += len(tail)
    return best, came, count


station_costs = float64_program(station_cost)


@float64_program
def edge_costs(
    criterion: Criterion | Weighted,
    a: Station,
    b: Station,
    tail: Int[Array, "E"],
    head: Int[Array, "E"],
) -> Float[Array, "E"]:
    """Costs of moves from nodes `tail` of a to nodes `head` of b: of the step, or for worst
    stations of the station where it ends."""
    if isinstance(criterion, Criterion) and criterion.kind == "max":
        return station_cost(criterion, b)[head]
    return step_cost(criterion, a.map(lambda of: of[tail]), b.map(lambda of: of[head]))


def costed_edges(
    grid: PostureGrid, step: int
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Tails, heads and costs of all edges of a step (see `edge_costs`), about EDGES at a time."""
    a, b = (layer.stations for layer in grid.layers[step : step + 2])
    for tail, head in _batches(grid.edges(step)):
        size = 1 << max(len(tail) - 1, 0).bit_length()  # few programs, whatever is admissible
        tails, heads = (np.resize(of, size).astype(np.int32) for of in (tail, head))
        found = edge_costs(grid.problem.posture.criterion, a, b, tails, heads)
        yield tail, head, found[: len(tail)]


def _batches(parts: Iterator[tuple[np.ndarray, np.ndarray]]) -> Iterator[np.ndarray]:
    """The same edges [2, n], about EDGES at a time; none that are empty."""
    waiting: list[np.ndarray] = []
    count = 0
    for part in parts:
        waiting.append(np.stack(part))
        count += len(part[0])
        if count >= EDGES:
            yield np.concatenate(waiting, axis=1)
            waiting, count = [], 0
    if count:
        yield np.concatenate(waiting, axis=1)
