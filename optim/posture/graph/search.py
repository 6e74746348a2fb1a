"""Choice of a path over the grid: point by point, and by dynamic programming with a proof.

The costs of arriving are potentials that bound all paths, verified edge by edge. Take any number y
for every node. Where y_head - y_tail <= cost for every edge, no path costs less than y at its end
less y where it began: the dual of the shortest path, without a linear program. Where an edge misses
that by something, the bound is lower by the worst miss of its step.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.optim.options import float64_program
from stickslip.optim.posture.criteria import (
    Criterion,
    Weighted,
    pointwise_cost,
    station_cost,
    step_cost,
)
from stickslip.optim.posture.graph.grid import (
    PostureGrid,
    build_grid,
    edge_costs,
    polished,
    station_costs,
)
from stickslip.optim.posture.result import PostureResult, below, closes
from stickslip.optim.posture.station import Station
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Int

    from stickslip.optim.posture.problem import PostureProblem

AGREEMENT = 1e-8
"""Relative difference of the recursion's value and the objective, or the proved bound, above which
it is no proof."""
OVER_GRID = "proved: the best of all {}, not of all drives"
EDGES = 1 << 18
"""About the number of edges whose costs are computed in one call."""


def solve_grid(
    problem: PostureProblem, *, progress: bool = False, polish: bool = False, angles: Any = None
) -> PostureResult:
    """Choose at each waypoint the admissible pair of leg angles whose own cost is least.

    The chapter's search. A worst-station criterion is judged by the station's cost. Sums over
    steps are not known of one station; in their place stands, for wheel_energy and total_energy,
    |M|, and for torque_variation |M - M'|, M' being the choice before (0 at the first waypoint);
    in weighted sums the weighted sum of these. So nothing says that such a choice is good.

    angles: of the grid, see build_grid; None: fitting_grid, 31 of each leg at least. leg_rate is
    not looked at, as in the chapter, and the result may break it (VIOLATED; its residuals say by
    how much). For single worst-station criteria grid_bound is the largest over the waypoints of the
    least cost there: no path over the grid is below it. evaluations: stations. details: grid,
    rate_used, grid_bound (None for sums). polish: see `polished`.
    """
    began = time.perf_counter()

    def search() -> PostureResult:
        grid = build_grid(problem, angles, method="grid", progress=progress)
        nodes, reason, bound = _choose(grid)
        common: dict[str, Any] = {"method": "grid", "began": began}
        common["evaluations"] = grid.evaluations
        if reason:
            return grid.without_path(len(nodes), reason, common)
        return problem.result(
            grid.angles_at(np.array(nodes)),
            status=OptimStatus.FEASIBLE,
            message="chosen point by point, leg_rate not looked at",
            details=grid.details | {"grid_bound": bound},
            **common,
        )

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
    problem: PostureProblem, *, progress: bool = False, polish: bool = False, angles: Any = None
) -> PostureResult:
    """The exact optimum over paths on a grid of leg angles, evenly spaced for each leg.

    angles: of the grid, see build_grid; None: fitting_grid, 31 of each leg at least.

    Value iteration forwards over the waypoints: V_k(j) = min over i of V_(k-1)(i) + cost(i, j) for
    criteria that are sums over steps, V_k(j) = min over i of max(V_(k-1)(i), cost(j)) for worst
    stations; i runs over the pairs of angles from which the rate lets both legs arrive. A weighted
    sum is accepted where all its parts are sums over steps. Time and memory: K n^2 w^2 and K n^2,
    w being the angles within reach; without a rate limit w is n, so keep the grid coarse.

    Given start and end angles are nodes of their own, on the grid or not. The grid's bound is what
    the costs of arriving prove as potentials (`certify`), less the rounding of the stations
    (`below`): no path over the grid is better. INACCURATE where it is not within 1e-8 of the value,
    nor within 1e-12 of what the vehicle's weight would give. It bounds no drive off the grid, so
    that lower_bound is None; `solve(problem, "branch")` has one. FAILED where there is no path over
    the grid: see `without_path`. evaluations: stations. details: grid, rate_used (the share of the
    leg rate that each leg can use on it), grid_bound, certificate (edges looked at, and by how much
    one misses its inequality at worst). polish: see `polished`.
    """
    began = time.perf_counter()
    require_one_kind(problem.criterion)

    def search() -> PostureResult:
        grid = build_grid(problem, angles, method="dp", progress=progress)
        common: dict[str, Any] = {"method": "dp", "began": began}
        common["evaluations"] = grid.evaluations
        paths = best_paths(grid)
        if paths.nodes is None:
            return grid.without_path(paths.stuck_at, paths.reason, common)
        value = float(np.min(paths.values[-1]))
        proof = certify(grid, paths.values)
        closed = closes(problem, value, proof.bound, AGREEMENT)
        details = grid.details | {
            "grid_bound": below(problem, proof.bound),
            "certificate": {"edges": proof.edges, "missed": proof.missed},
        }
        proved = OVER_GRID.format(grid.what) if closed else f"no better path by {proof.bound!r}"
        result = problem.result(
            grid.angles_at(paths.nodes),
            status=OptimStatus.FEASIBLE if closed else OptimStatus.INACCURATE,
            message=grid.stuck or proved,
            details=details,
            **common,
        )
        return _agreed(problem, result, value)

    return polished(problem, polish, progress, search)


def require_one_kind(criterion: Criterion | Weighted) -> None:
    """Raise ValueError for a weighted sum that holds a worst station."""
    if isinstance(criterion, Weighted) and not criterion.additive:
        bad = next(one.name for one, _ in criterion.parts if not one.additive)
        raise ValueError(
            f"criterion = {criterion.name} holds {bad}, a worst station, which has no recursion in "
            "a weighted sum; accepted: single criteria, and weighted sums of sums over steps"
        )


def _agreed(problem: PostureProblem, result: PostureResult, value: float) -> PostureResult:
    """The result, INACCURATE and without the grid's bound where the objective is not `value`."""
    low, high = sorted((value, result.value))
    if closes(problem, high, low, AGREEMENT):
        return result
    return replace(
        result,
        status=OptimStatus.INACCURATE,
        details={name: of for name, of in result.details.items() if name != "grid_bound"},
        message=f"the objective is {result.value!r} where {value!r} was computed",
    )


class Paths(NamedTuple):
    """Outcome of the recursion."""

    values: list[np.ndarray]
    """Least cost of arriving at each node of each waypoint; infinite where none arrives."""
    nodes: np.ndarray | None
    """The best path's node at each waypoint [K]; None where no path arrives."""
    stuck_at: int = 0
    """The first waypoint where none does."""
    reason: str = ""
    """Reason why there is none."""


def best_paths(grid: PostureGrid) -> Paths:
    """The recursion over all waypoints and the best path's nodes."""
    K = len(grid.layers)
    first, past = grid.free
    costs = [_first_costs(grid)]
    back: list[np.ndarray] = []
    if first == 1 and first < past:
        _arrive(grid, 0, costs, back)
    if past - first > 1:
        within, came = _over_grid(grid, costs[-1])
        costs.extend(within)
        back.extend(came)
    while len(costs) < K:  # the given end
        _arrive(grid, len(costs) - 1, costs, back)
    for k, of in enumerate(costs):
        if not np.any(np.isfinite(of)):
            reached = np.isfinite(costs[k - 1]) if k else np.zeros(0)
            return Paths(costs, None, k, grid.why_stuck(k, reached))
    nodes = np.zeros(K, dtype=int)
    nodes[-1] = np.argmin(costs[-1])
    for k in range(K - 1, 0, -1):
        nodes[k - 1] = back[k - 1][nodes[k]]
    return Paths(costs, nodes)


def _first_costs(grid: PostureGrid) -> np.ndarray:
    """The cost of beginning at each node of the first waypoint."""
    begin = grid.layers[0]
    criterion = grid.problem.posture.criterion
    cost = np.zeros(begin.stations.torque.shape)
    if criterion.kind == "max":
        cost = station_costs(criterion, begin.stations)
    return np.where(begin.admissible, cost, np.inf)


def _arrive(grid: PostureGrid, step: int, costs: list[np.ndarray], back: list[np.ndarray]):
    """Append the costs of the next waypoint and whence, all moves of one step looked at.

    For a step from or to a given pair, which has one node at one of its ends.
    """
    a, b = (layer.stations for layer in grid.layers[step : step + 2])
    from_all = a.map(lambda of: np.expand_dims(of, 1))
    arrived = _arrivals(grid.problem.posture.criterion, costs[-1][:, None], from_all, b)
    allowed = grid.within(step, a.leg_angles[:, None], b.leg_angles)
    allowed &= grid.layers[step + 1].admissible & np.isfinite(costs[-1])[:, None]
    arrived = np.where(allowed, arrived, np.inf)
    back.append(np.argmin(arrived, axis=0))
    costs.append(np.min(arrived, axis=0))


def _arrival(criterion: Criterion | Weighted, cost_a: Array, a: Station, b: Station) -> Array:
    """The cost at b of coming from a, where it is cost_a."""
    if criterion.kind == "max":
        return jnp.maximum(cost_a, station_cost(criterion, b))
    return cost_a + step_cost(criterion, a, b)


_arrivals = float64_program(_arrival)


def _over_grid(grid: PostureGrid, cost: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Costs and predecessors at the grid's waypoints after its first, [N] each."""
    first, past = grid.free
    R, F = grid.shape
    stations = grid.stations.map(lambda of: of[first:past].reshape(-1, R, F, *of.shape[2:]))
    ok = np.stack([layer.admissible for layer in grid.layers[first:past]])
    moves = np.array(grid.moves(), dtype=np.int32)
    costs, whence = _recursion(
        grid.problem.posture.criterion,
        stations,
        ok.reshape(-1, R, F),
        grid.windows()[first : past - 1],
        moves,
        cost.reshape(R, F),
    )
    rear, front = np.indices(grid.shape)
    shift = moves[whence]
    came = (rear - shift[..., 0]) * F + (front - shift[..., 1])
    return list(costs.reshape(len(came), -1)), list(came.reshape(len(came), -1))


@float64_program
def _recursion(
    criterion: Criterion | Weighted,
    stations: Station,
    ok: Array,
    windows: Int[Array, "k 2"],
    moves: Int[Array, "w 2"],
    cost: Float[Array, "R F"],
) -> tuple[Array, Array]:
    """Costs [k, R, F] after each step and which of the moves leads there.

    One move at a time for all pairs at once: the stations before the step, rolled by the move,
    stand beside those after it; what was rolled in from the other side is out of the window.
    """
    R, F = cost.shape
    rear, front = jnp.arange(R, dtype=jnp.int32)[:, None], jnp.arange(F, dtype=jnp.int32)
    inf = jnp.asarray(jnp.inf, cost.dtype)

    def step(carry, now):
        before, cost = carry
        after, good, window = now

        def move(best, numbered):
            number, by = numbered
            least, which = best
            a, from_cost = jax.tree.map(lambda of: jnp.roll(of, by, (0, 1)), (before, cost))
            i, j = rear - by[0], front - by[1]
            inside = (i >= 0) & (i < R) & (j >= 0) & (j < F) & jnp.all(jnp.abs(by) <= window)
            total = _arrival(criterion, from_cost, a, after)
            total = jnp.where(inside & good & jnp.isfinite(from_cost), total, inf)
            better = total < least
            return (jnp.where(better, total, least), jnp.where(better, number, which)), None

        start = (jnp.full_like(cost, inf), jnp.zeros(cost.shape, jnp.int32))
        numbers = jnp.arange(len(moves), dtype=jnp.int32)
        (least, which), _ = jax.lax.scan(move, start, (numbers, moves))
        return (after, least), (least, which)

    first = jax.tree.map(lambda of: of[0], stations)
    rest = jax.tree.map(lambda of: of[1:], stations)
    return jax.lax.scan(step, (first, cost), (rest, ok[1:], windows))[1]


class Certificate(NamedTuple):
    """Bound that potentials prove for a grid's paths."""

    bound: float
    """No path over the grid costs less, but for the rounding of its stations."""
    missed: float
    """Largest violation of an edge's inequality, in the criterion's unit."""
    edges: int
    """Number of edges verified: all that the rate and the constraints allow."""


def certify(grid: PostureGrid, potentials: Sequence[np.ndarray]) -> Certificate:
    """The bound that potentials of the nodes, [N] for each waypoint, prove.

    Whoever gives them is trusted in nothing: costs come from the grid's stations, which pairs of
    nodes are edges from its angles, the rate and the constraints. Infinite: no path arrives there,
    which is looked up, too. Sums over steps: y_head <= y_tail + cost. Worst stations: y_head <=
    max(y_tail, cost).
    """
    y = np.asarray(potentials[0], float)
    join = np.maximum if grid.problem.criterion.kind == "max" else np.add
    first = _room(_first_costs(grid), y)
    missed, lost, edges = max(0.0, -first), max(-first, 0.0), 0
    for step, after in enumerate(np.asarray(of, float) for of in potentials[1:]):
        least = 0.0
        for tail, head, cost in costed_edges(grid, step):
            least = min(least, _room(join(y[tail], cost), after[head]))
            edges += len(tail)
        missed, lost, y = max(missed, -least), lost - least, after
    ends = float(np.min(y))
    size = float(np.max(np.abs(y[np.isfinite(y)]), initial=0.0))
    rounding = 4 * np.finfo(float).eps * size * (len(potentials) + 1)
    return Certificate(ends - lost - rounding, missed, edges)


def _room(cost: np.ndarray, y: np.ndarray) -> float:
    """The least room that finite costs leave above y; none where y is infinite or no number."""
    counts = np.isfinite(cost)
    cost, y = cost[counts], y[counts]
    if not np.all(np.isfinite(y)):
        return -np.inf
    return float(np.min(cost - y, initial=np.inf))


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
