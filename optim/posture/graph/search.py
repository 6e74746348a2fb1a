"""Choice of a path over the grid: point by point, and by dynamic programming with a proof.

The costs of arriving are potentials that bound all paths, verified edge by edge. Take any number y
for every node. Where y_head - y_tail <= cost for every edge, no path costs less than y at its end
less y where it began: the dual of the shortest path, without a linear program. Where an edge misses
that by something, the bound is lower by the worst miss of its step.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_kind
from stickslip.optim.posture.criteria import (
    Criterion,
    Weighted,
    pointwise_cost,
    station_cost,
    step_cost,
)
from stickslip.optim.posture.finer import result_at
from stickslip.optim.posture.graph.grid import (
    PostureGrid,
    build_grid,
    moves_of_step,
    offsets,
    polishable,
    without_path,
)
from stickslip.optim.posture.result import PostureResult, below, closes
from stickslip.optim.posture.station import Station
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Int

    from stickslip.optim.posture.graph.grid import PostureGrid
    from stickslip.optim.posture.problem import PostureProblem

    Edges = tuple[np.ndarray, np.ndarray]
    """Nodes before and after each."""


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


AGREEMENT = 1e-8
"""Relative difference of the recursion's value and the objective, or the proved bound, above which
it is no proof."""
OVER_GRID = "proved: the best of all {}, not of all drives"


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


@polishable
def solve_dp(
    problem: PostureProblem, *, progress: bool = False, angles: Any = None
) -> PostureResult:
    """The exact optimum over paths on a grid of leg angles, evenly spaced for each leg.

    angles: of the grid, see build_grid; None: fitting_grid, 31 of each leg at least.

    Value iteration forwards over the waypoints: V_k(j) = min over i of V_(k-1)(i) + cost(i, j) for
    criteria that are sums over steps, V_k(j) = min over i of max(V_(k-1)(i), cost(j)) for worst
    stations; i runs over the pairs of angles from which the rate lets both legs arrive. A weighted
    sum is accepted where all its parts are sums over steps. Time and memory: K n^2 w^2 and K n^2,
    w being the angles within reach; without a rate limit w is n, so keep the grid coarse.

    Given start and end angles are nodes of their own, on the grid or not. The grid's bound is what
    the costs of arriving prove as potentials, every edge looked up anew (certificate.py), less the
    rounding of the stations (rounding.py): no path over the grid is better. INACCURATE where it is
    not within 1e-8 of the value, nor within 1e-12 of what the vehicle's weight would give. It
    bounds no drive off the grid, so that lower_bound is None; `solve(problem, "branch")` has one.
    FAILED where there is no path over the grid: see `without_path`. evaluations: stations.
    details: grid, rate_used (the share of the leg rate that each leg can use on it), grid_bound,
    certificate (edges looked at, and by how much one misses its inequality at worst).
    """
    began = time.perf_counter()
    require_one_kind(problem.criterion)
    grid = build_grid(problem, angles, method="dp", progress=progress)
    common: dict[str, Any] = {
        "method": "dp",
        "began": began,
        "evaluations": grid.evaluations,
    }
    paths = best_paths(grid)
    if paths.nodes is None:
        return without_path(grid, paths.stuck_at, paths.reason, common)
    value = float(np.min(paths.values[-1]))
    x = angles_at(grid, paths.nodes)
    proof = certify(grid, paths.values)
    closed = closes(problem, value, proof.bound, AGREEMENT)
    details = grid.details | {
        "grid_bound": below(problem, proof.bound),
        "certificate": {"edges": proof.edges, "missed": proof.missed},
    }
    proved = OVER_GRID.format(grid.what) if closed else f"no better path by {proof.bound!r}"
    result = result_at(
        problem,
        x,
        status=OptimStatus.FEASIBLE if closed else OptimStatus.INACCURATE,
        message=grid.stuck or proved,
        details=details,
        **common,
    )
    return agreed(problem, result, value)


def require_one_kind(criterion: Criterion | Weighted) -> None:
    """Raise ValueError for a weighted sum that holds a worst station."""
    if isinstance(criterion, Weighted) and not criterion.additive:
        bad = next(one.name for one, _ in criterion.parts if not one.additive)
        raise ValueError(
            f"criterion = {criterion.name} holds {bad}, a worst station, which has no recursion in "
            "a weighted sum; accepted: single criteria, and weighted sums of sums over steps"
        )


def agreed(problem: PostureProblem, result: PostureResult, value: float) -> PostureResult:
    """The result, INACCURATE and without the grid's bound where the objective is not `value`."""
    low, high = sorted((value, result.value))
    if closes(problem, high, low, AGREEMENT):
        return result
    fields = vars(result) | {
        "status": OptimStatus.INACCURATE,
        "details": {name: of for name, of in result.details.items() if name != "grid_bound"},
        "message": f"the objective is {result.value!r} where {value!r} was computed",
    }
    return PostureResult(**fields)


def angles_at(grid: PostureGrid, nodes: np.ndarray) -> Float[np.ndarray, "K 2"]:
    """The angles of a path given by its nodes."""
    return np.stack([grid.layer(k).stations.leg_angles[node] for k, node in enumerate(nodes)])


def best_paths(grid: PostureGrid) -> Paths:
    """The recursion over all waypoints and the best path's nodes."""
    K = len(grid.problem.x)
    first, last = grid.free
    costs = [_first_costs(grid, first)]
    back: list[np.ndarray] = []
    if first == 1 and first < last:
        _arrive(grid, 0, costs, back)
    if first < last:
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


def _first_costs(grid: PostureGrid, first: int) -> np.ndarray:
    """The cost of beginning at each node of the first waypoint."""
    begin = grid.layer(0).stations
    cost = np.zeros(begin.torque.shape)
    if grid.problem.criterion.kind == "max":
        with jax.enable_x64(True):
            cost = np.asarray(station_cost(grid.problem.criterion, begin))
    return np.where(grid.admissible(0), cost, np.inf)


def _arrive(grid: PostureGrid, step: int, costs: list[np.ndarray], back: list[np.ndarray]):
    """Append the costs of the next waypoint and whence, all moves of one step looked at.

    For a step from or to a given pair, which has one node at one of its ends.
    """
    a, b = grid.layer(step).stations, grid.layer(step + 1).stations
    from_all = a.map(lambda of: np.expand_dims(of, 1))
    with jax.enable_x64(True):
        criterion = grid.problem.posture.criterion
        arrived = np.asarray(_joined(criterion, costs[-1][:, None], from_all, b))
    allowed = grid.within(step, a.leg_angles[:, None], b.leg_angles)
    arrived = np.where(allowed & grid.admissible(step + 1), arrived, np.inf)
    arrived = np.where(np.isfinite(costs[-1])[:, None], arrived, np.inf)
    back.append(np.argmin(arrived, axis=0))
    costs.append(np.min(arrived, axis=0))


def _joined(criterion: Criterion | Weighted, cost_a: Any, a: Station, b: Station) -> Array:
    """The cost at b of coming from a, where it is cost_a."""
    if criterion.kind == "max":
        return jnp.maximum(cost_a, station_cost(criterion, b))
    return cost_a + step_cost(criterion, a, b)


def _over_grid(grid: PostureGrid, cost: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Costs and predecessors at the grid's waypoints after its first, [N] each."""
    first, last = grid.free
    if last - first < 2:
        return [], []
    stations = grid.stations.map(lambda of: _in_plane(of[first:last], grid.shape))
    ok = np.stack([grid.admissible(k) for k in range(first, last)])
    moves = np.array(list(offsets(grid)), dtype=np.int32)
    with jax.enable_x64(True):
        costs, whence = _recursion(
            grid.problem.posture.criterion,
            stations,
            ok.reshape(-1, *grid.shape),
            grid.windows()[first : last - 1],
            moves,
            cost.reshape(grid.shape),
        )
    rear, front = np.indices(grid.shape)
    shift = moves[np.asarray(whence)]
    came = (rear - shift[..., 0]) * grid.shape[1] + (front - shift[..., 1])
    flat = (len(came), -1)
    return list(np.asarray(costs).reshape(flat)), list(came.reshape(flat))


def _in_plane(nodes: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """[K, N, ...] as [K, R, F, ...]."""
    return nodes.reshape(nodes.shape[0], *shape, *nodes.shape[2:])


@jax.jit
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
            total = _joined(criterion, from_cost, a, after)
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


EDGES = 1 << 18
"""About the number of edges whose costs are computed in one call."""


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
    criterion = grid.problem.posture.criterion
    worst_of = criterion.kind == "max"
    missed, edges = 0.0, 0
    lost = 0.0
    y = np.asarray(potentials[0], float)
    begin = np.zeros(y.shape)
    if worst_of:
        with jax.enable_x64(True):
            begin = np.asarray(_station_costs(criterion, grid.layer(0).stations))
    begin = np.where(grid.admissible(0), begin, np.inf)
    first = _least(begin, y)
    missed, lost = max(missed, -first), lost + max(-first, 0.0)
    for step in range(len(potentials) - 1):
        after = np.asarray(potentials[step + 1], float)
        least = 0.0
        for tail, head, cost in _costs(grid, step, criterion, worst_of):
            from_there = y[tail]
            arrived = np.maximum(from_there, cost) if worst_of else from_there + cost
            least = min(least, _least(arrived, after[head]))
            edges += len(tail)
        missed, lost, y = max(missed, -least), lost - least, after
    ends = float(np.min(y))
    size = float(np.max(np.abs(y[np.isfinite(y)]), initial=0.0))
    rounding = 4 * np.finfo(float).eps * size * (len(potentials) + 1)
    return Certificate(ends - lost - rounding, missed, edges)


def _least(cost: np.ndarray, y: np.ndarray) -> float:
    """The least room that finite costs leave above y; none where y is infinite or no number."""
    counts = np.isfinite(cost)
    cost, y = cost[counts], y[counts]
    if not np.all(np.isfinite(y)):
        return -np.inf
    return float(np.min(cost - y, initial=np.inf))


def _costs(
    grid: PostureGrid, step: int, criterion: Criterion | Weighted, worst_of: bool
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """All edges of a step and their costs, about EDGES at a time."""
    a, b = grid.layer(step).stations, grid.layer(step + 1).stations
    for tail, head in _together(moves_of_step(grid, step)):
        size = 1 << max(len(tail) - 1, 0).bit_length()  # few programs, whatever is admissible
        tails, heads = (np.resize(of, size).astype(np.int32) for of in (tail, head))
        with jax.enable_x64(True):
            if worst_of:
                found = _arrivals(criterion, b, heads)
            else:
                found = _edge_costs(criterion, a, b, tails, heads)
        yield tail, head, np.asarray(found)[: len(tail)]


def _together(parts: Iterator[Edges]) -> Iterator[np.ndarray]:
    """The same edges, about EDGES at a time; none that are empty."""
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


@jax.jit
def _edge_costs(
    criterion: Criterion | Weighted,
    a: Station,
    b: Station,
    tail: Int[Array, "E"],
    head: Int[Array, "E"],
) -> Array:
    """Costs of edges; only the entries that the criterion reads are gathered."""
    before, after = a.map(lambda of: of[tail]), b.map(lambda of: of[head])
    return step_cost(criterion, before, after)


@jax.jit
def _arrivals(criterion: Criterion | Weighted, b: Station, head: Int[Array, "E"]) -> Array:
    return jnp.asarray(station_cost(criterion, b))[head]


_station_costs = jax.jit(station_cost)
