"""The best path over the grid as a flow, a linear program in cvxpy whose dual certifies it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import cvxpy as cp
import jax
import numpy as np
import scipy.sparse as sp

from stickslip.dynamics.checks import require_choice, require_integer, require_memory
from stickslip.optim.cvx import solve_quietly
from stickslip.optim.options import COUNT
from stickslip.optim.posture.criteria import station_cost, step_cost
from stickslip.optim.posture.finer import result_at
from stickslip.optim.posture.graph.grid import (
    PostureGrid,
    build_grid,
    moves_of_step,
    polishable,
    without_path,
)
from stickslip.optim.posture.graph.search import OVER_GRID, angles_at, best_paths, require_one_kind
from stickslip.optim.posture.result import PostureResult, below, closes
from stickslip.optim.posture.result import slack as slack_of
from stickslip.optim.posture.station import Station
from stickslip.optim.posture.waypoints import EDGE
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from jaxtyping import Float, Int

    from stickslip.optim.posture.graph.grid import PostureGrid
    from stickslip.optim.posture.problem import PostureProblem


SOLVERS = ("HIGHS", "SCIPY", "CLARABEL")
"""Solvers for linear programs, the first that is installed by default."""
LEAST = 11
"""Angles of each leg at least, where none are given."""
GAP = 1e-6
"""Relative gap between value and bound up to which the path counts as proved optimal."""
SLACK = 1e-12
"""Relative rounding of a station's cost, which two programs may compute differently."""
WHOLE = 1e-6
"""Tolerance of a flow of 0 or 1."""


@dataclass(frozen=True)
class Flow:
    """A solved linear program: the flow on each edge, a proved bound, and how it ended."""

    edges: np.ndarray | None
    bound: float | None
    status: OptimStatus
    message: str


@polishable
def solve_lp(
    problem: PostureProblem,
    *,
    progress: bool = False,
    angles: Any = None,
    most_edges: int = 2_000_000,
    solver: str | None = None,
) -> PostureResult:
    """dp's optimum as a flow of 1 through the graph of admissible stations and moves.

    minimise sum of c_e f_e, f >= 0, as much out of each node as into it. The matrix is totally
    unimodular, so a basic solution is a path. With y the dual values as potentials of the nodes,
    every path costs y_end - y_start plus the reduced costs c_e - (y_head - y_tail) of its edges;
    one edge of each step is on it, so y_end - y_start + sum over steps of the least reduced cost
    there is below every path's cost whatever y is: that is computed in NumPy from y alone and is
    the grid's bound, less what rounding may do to the stations (rounding.py), the solver trusted in
    nothing. INACCURATE where it is not within 1e-6 of the value, nor within 1e-12 of what the
    vehicle's weight would give. lower_bound is None, and without a path it ends, as dp's does.

    Worst-station criteria: v is dp's value, and a station costs 1 where its cost is v or more and
    K + 1 more where it is more than v. A bound above 0 then proves that every path holds a station
    at least as bad as v (less a rounding, which the bound is lowered by).

    angles: as in dp, but 11 of each leg at least for None. most_edges: ValueError for a graph with
    more. solver: one of SOLVERS. evaluations: stations. details: grid, rate_used, grid_bound (None:
    not proved), edges, solver.
    """
    began = time.perf_counter()
    require_one_kind(problem.criterion)
    most_edges = require_integer("most_edges", most_edges, high=COUNT)
    solver = _solver(solver)
    grid = build_grid(problem, angles, method="lp", progress=progress, least=LEAST)
    common: dict[str, Any] = {
        "method": "lp",
        "began": began,
        "evaluations": grid.evaluations,
    }
    threshold, slack = None, 0.0
    if problem.criterion.kind == "max":
        paths = best_paths(grid)
        if paths.nodes is None:
            return without_path(grid, paths.stuck_at, paths.reason, common)
        threshold = float(np.min(paths.values[-1]))
        slack = max(SLACK * (1 + abs(threshold)), threshold - below(problem, threshold))
    graph = build_graph(grid, threshold, slack, most_edges)
    if graph.empty:
        paths = best_paths(grid)
        return without_path(grid, paths.stuck_at, paths.reason, common)
    flow = solve_flow(graph, solver)
    details = grid.details | {"edges": len(graph.tail), "solver": solver}
    common["details"] = details
    if flow.edges is None:
        return PostureResult.without_point(status=flow.status, message=flow.message, **common)
    bound = flow.bound
    if threshold is not None:
        bound = threshold - slack if bound is not None and bound > 0.5 else None
    details["grid_bound"] = bound
    return _result(problem, grid, graph, flow, common)


def solve_flow(graph: LayeredGraph, solver: str) -> Flow:
    """The linear program; statuses are mapped, and solver errors are FAILED."""
    edges, nodes = len(graph.tail), graph.nodes
    numbers = np.arange(edges)
    signs = np.concatenate([np.ones(edges), -np.ones(edges)])
    where = (np.concatenate([graph.tail, graph.head]), np.tile(numbers, 2))
    balance = sp.csr_array((signs, where), shape=(nodes, edges))
    supply = np.zeros(nodes)
    supply[graph.source], supply[graph.sink] = 1, -1
    f = cp.Variable(edges, nonneg=True)
    conserved: Any = balance @ f == supply
    program = cp.Problem(cp.Minimize(graph.cost @ f), [conserved])
    ended = solve_quietly(program, solver)
    if f.value is None or not ended.answered:  # the flow is known to be feasible
        return Flow(None, None, OptimStatus.FAILED, ended.message)
    bound = None
    if conserved.dual_value is not None:
        # Which sign the solver's interface gives the dual is not relied on: either is a bound.
        bound = max(proved_bound(graph, y) for y in (conserved.dual_value, -conserved.dual_value))
    return Flow(np.asarray(f.value), bound, ended.status, ended.message)


def proved_bound(graph: LayeredGraph, y: np.ndarray) -> float:
    """A lower bound of every path's cost from any potentials y of the nodes (see solve_lp)."""
    reduced = graph.cost - (y[graph.head] - y[graph.tail])
    least = np.minimum.reduceat(reduced, graph.begins)
    bound = y[graph.sink] - y[graph.source] + np.sum(least)
    # What the sums above may have lost: a rounding of each addend.
    size = np.max(np.abs(y)) + np.max(np.abs(graph.cost))
    bound -= 4 * np.finfo(float).eps * size * (len(least) + 1)
    return float(bound - graph.rounding(float(bound)))


def _result(
    problem: PostureProblem,
    grid: PostureGrid,
    graph: LayeredGraph,
    flow: Flow,
    common: dict[str, Any],
) -> PostureResult:
    """The path of the flow, and the grid's bound."""
    bound = common["details"]["grid_bound"]
    chosen, spread = (None, 0.0) if flow.edges is None else graph.path(flow.edges)
    if chosen is None:
        message = f"{flow.message}; the flow is no path"
        status = OptimStatus.FAILED
        return PostureResult.without_point(status=status, message=message, **common)
    x = angles_at(grid, chosen)
    value = problem.objective(x.reshape(-1))
    ended = flow.status is OptimStatus.OPTIMAL
    status = OptimStatus.FEASIBLE if ended else flow.status
    message = grid.stuck or (OVER_GRID.format(grid.what) if ended else flow.message)
    if not closes(problem, value, bound, GAP):
        status = OptimStatus.INACCURATE if ended else status
        message = f"{flow.message}; value {value!r}, proved bound {bound!r}"
    elif spread > WHOLE:
        status, message = OptimStatus.INACCURATE, f"{flow.message}; off whole numbers by {spread}"
    return result_at(problem, x, status=status, message=message, **common)


def _solver(name: str | None) -> str:
    installed = [known for known in SOLVERS if known in cp.installed_solvers()]
    if name is None:
        return installed[0]
    require_choice("solver", name, installed)
    return name


@dataclass(frozen=True)
class LayeredGraph:
    """Edges from `tail` to `head`, sorted by the step of the drive that they belong to.

    Nodes are numbered waypoint by waypoint, N of them each, and then the source, from which an edge
    goes to every node of the first waypoint, and the sink. begins: where the edges of each step
    begin; the source's are the first and the sink's the last.
    """

    tail: Int[np.ndarray, "E"]
    head: Int[np.ndarray, "E"]
    cost: Float[np.ndarray, "E"]
    begins: Int[np.ndarray, "K+1"]
    waypoints: int
    per_waypoint: int
    empty: bool = False
    """No path leads through."""
    rounding: Callable[[float], float] = lambda value: 0.0
    """Rounding error of a path's cost of about this value."""

    @property
    def source(self) -> int:
        """The node from which the flow comes."""
        return self.waypoints * self.per_waypoint

    @property
    def sink(self) -> int:
        """The node to which it goes."""
        return self.source + 1

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return self.source + 2

    def path(self, flow: np.ndarray) -> tuple[np.ndarray | None, float]:
        """The nodes [K] on the edges that carry most, and by how much a flow misses 0 or 1.

        None where these edges do not join.
        """
        ends = np.append(self.begins[1:], len(flow))
        edges = [int(a + np.argmax(flow[a:b])) for a, b in zip(self.begins, ends, strict=True)]
        spread = float(np.max(np.abs(flow - np.round(flow))))
        if np.any(self.head[edges[:-1]] != self.tail[edges[1:]]):
            return None, spread
        return self.head[edges[:-1]] % self.per_waypoint, spread


def build_graph(
    grid: PostureGrid, threshold: float | None, slack: float, most_edges: int
) -> LayeredGraph:
    """All edges with their costs; threshold: a worst station's value to certify (see solve_lp), two
    values being the same when they differ by no more than slack.

    ValueError for more than `most_edges`, or than fit.
    """
    K, N = len(grid.problem.x), grid.shape[0] * grid.shape[1]
    first, last = (np.flatnonzero(grid.admissible(k)) for k in (0, K - 1))
    edges = _Edges(most_edges, len(first) + len(last))
    moves = [_moves(grid, step, edges) for step in range(K - 1)]
    edges.require_room()
    source = np.full(len(first), K * N)
    tails = [source, *(a + k * N for k, (a, _) in enumerate(moves)), last + (K - 1) * N]
    heads = [first, *(b + (k + 1) * N for k, (_, b) in enumerate(moves)),
             np.full(len(last), K * N + 1)]  # fmt: skip
    empty = not all(map(len, tails)) or not _connected(moves, first, N)
    begins = np.cumsum([0, *map(len, tails[:-1])])
    tail, head = np.concatenate(tails), np.concatenate(heads)
    cost = np.zeros(0) if empty else _costs(grid, tail, head, threshold, slack)
    if threshold is not None:  # whole numbers
        return LayeredGraph(tail, head, cost, begins, K, N, empty)
    rounding = partial(slack_of, grid.problem, criterion=grid.problem.criterion)
    return LayeredGraph(tail, head, cost, begins, K, N, empty, rounding)


@dataclass
class _Edges:
    """Number of edges so far; counted as they are found, so that too many never exist."""

    most: int
    count: int

    def add(self, more: int) -> None:
        self.count += more
        if self.count > self.most:
            raise ValueError(
                f"the graph has {self.count} edges or more; accepted: most_edges = {self.most}; "
                "take fewer angles or a lower leg_rate, or raise most_edges"
            )

    def require_room(self) -> None:
        """Refuse a linear program that does not fit."""
        require_memory(f"most_edges = {self.most}", "edges in lp's graph", self.count, EDGE)


def _moves(grid: PostureGrid, step: int, edges: _Edges) -> tuple[np.ndarray, np.ndarray]:
    """Nodes before and after each admissible move of one step."""
    tails, heads = [np.zeros(0, int)], [np.zeros(0, int)]
    for tail, head in moves_of_step(grid, step):
        edges.add(len(tail))
        tails.append(tail)
        heads.append(head)
    return np.concatenate(tails), np.concatenate(heads)


def _connected(moves: list[tuple[np.ndarray, np.ndarray]], first: np.ndarray, count: int) -> bool:
    """True if a path leads from the first waypoint to the last."""
    reached = np.zeros(count, dtype=bool)
    reached[first] = True
    for a, b in moves:
        after = np.zeros(count, dtype=bool)
        after[b[reached[a]]] = True
        reached = after
    return bool(np.any(reached))


def _costs(
    grid: PostureGrid, tail: np.ndarray, head: np.ndarray, threshold: float | None, slack: float
) -> np.ndarray:
    """The cost of each edge: of its step, or of the station that it leads to, 0 to the sink."""
    K, N = len(grid.problem.x), grid.shape[0] * grid.shape[1]
    layers = [grid.layer(k).stations for k in range(K)]
    cost = np.zeros(len(tail))
    inner = (tail < K * N) & (head < K * N)
    criterion = grid.problem.posture.criterion
    with jax.enable_x64(True):
        if threshold is None:
            a, b = (_gather(layers, of[inner], N) for of in (tail, head))
            cost[inner] = np.asarray(_step_costs(criterion, a, b))
            return cost
        to_station = head < K * N
        worst = np.asarray(_station_costs(criterion, _gather(layers, head[to_station], N)))
    cost[to_station] = (worst >= threshold - slack) + (K + 1.0) * (worst > threshold + slack)
    return cost


def _gather(layers: list[Station], nodes: np.ndarray, count: int) -> Station:
    """The stations of nodes given by their numbers in the graph."""
    k, node = np.divmod(nodes, count)
    begins = np.cumsum([0, *(len(of.torque) for of in layers[:-1])])
    joined = jax.tree.map(lambda *of: np.concatenate(of), *layers)
    return joined.map(lambda of: of[begins[k] + node])


_step_costs = jax.jit(step_cost)
_station_costs = jax.jit(station_cost)
