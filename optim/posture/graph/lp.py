"""The best path over the grid as a flow, a linear program in cvxpy whose dual certifies it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import cvxpy as cp
import numpy as np
import scipy.sparse as sp

from stickslip.dynamics.checks import require_memory
from stickslip.optim.cvx import solve_quietly
from stickslip.optim.posture.graph.grid import build_grid, polished, station_costs
from stickslip.optim.posture.graph.search import (
    OVER_GRID,
    best_paths,
    costed_edges,
    require_one_kind,
)
from stickslip.optim.posture.result import PostureResult, below, closes
from stickslip.optim.posture.waypoints import EDGE
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from jaxtyping import Float, Int

    from stickslip.optim.posture.graph.grid import PostureGrid
    from stickslip.optim.posture.problem import PostureProblem

LEAST = 11
"""Angles of each leg at least, where none are given."""
GAP = 1e-6
"""Relative gap between value and bound up to which the path counts as proved optimal."""
SLACK = 1e-12
"""Relative rounding of a station's cost, which two programs may compute differently."""
WHOLE = 1e-6
"""Tolerance of a flow of 0 or 1."""


def solve_lp(
    problem: PostureProblem,
    *,
    progress: bool = False,
    polish: bool = False,
    angles: Any = None,
) -> PostureResult:
    """dp's optimum as a flow of 1 through the graph of admissible stations and moves.

    minimise sum of c_e f_e, f >= 0, as much out of each node as into it. The matrix is totally
    unimodular, so a basic solution is a path. With y the dual values as potentials of the nodes,
    every path costs y_end - y_start plus the reduced costs c_e - (y_head - y_tail) of its edges;
    one edge of each step is on it, so y_end - y_start + sum over steps of the least reduced cost
    there is below every path's cost whatever y is: that is computed in NumPy from y alone and is
    the grid's bound, less what rounding may do to the stations (`below`), the solver trusted in
    nothing. INACCURATE where it is not within 1e-6 of the value, nor within 1e-12 of what the
    vehicle's weight would give. lower_bound is None, and without a path it ends, as dp's does.

    Worst-station criteria: v is dp's value, and a station costs 1 where its cost is v or more and
    K + 1 more where it is more than v. A bound above 0 then proves that every path holds a station
    at least as bad as v (less a rounding, which the bound is lowered by).

    angles: as in dp, but 11 of each leg at least for None. evaluations: stations. details: grid,
    rate_used, grid_bound (None: not proved), edges. polish: see `polished`.
    """
    began = time.perf_counter()
    require_one_kind(problem.criterion)

    def search() -> PostureResult:
        grid = build_grid(problem, angles, method="lp", progress=progress, least=LEAST)
        common: dict[str, Any] = {"method": "lp", "began": began}
        common["evaluations"] = grid.evaluations
        paths = best_paths(grid)
        if paths.nodes is None:
            return grid.without_path(paths.stuck_at, paths.reason, common)
        threshold, slack = None, 0.0
        if problem.criterion.kind == "max":
            threshold = float(np.min(paths.values[-1]))
            slack = max(SLACK * (1 + abs(threshold)), threshold - below(problem, threshold))
        graph = build_graph(grid, threshold, slack)
        flow = solve_flow(graph)
        details = grid.details | {"edges": len(graph.tail)}
        common["details"] = details
        if flow.edges is None:
            return PostureResult.without_point(status=flow.status, message=flow.message, **common)
        bound = flow.bound
        if threshold is None:
            bound = None if bound is None else below(problem, bound)
        else:
            bound = threshold - slack if bound is not None and bound > 0.5 else None
        details["grid_bound"] = bound
        return _result(grid, graph, flow, common)

    return polished(problem, polish, progress, search)


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
    per_waypoint: int

    @property
    def source(self) -> int:
        """The node from which the flow comes; the next is the one to which it goes."""
        return (len(self.begins) - 1) * self.per_waypoint

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


def build_graph(grid: PostureGrid, threshold: float | None, slack: float) -> LayeredGraph:
    """All edges with their costs; threshold: a worst station's value to certify (see solve_lp), two
    values being the same when they differ by no more than slack.

    ValueError for more than fit.
    """
    K, N = len(grid.layers), grid.shape[0] * grid.shape[1]
    first, last = (np.flatnonzero(grid.layers[k].admissible) for k in (0, K - 1))
    begin = np.zeros(len(first))
    if threshold is not None:
        begin = station_costs(grid.problem.posture.criterion, grid.layers[0].stations)[first]
    steps = [[(np.full(len(first), K * N), first, begin)]]
    count = len(first) + len(last)
    for step in range(K - 1):
        steps.append([])
        for tail, head, cost in costed_edges(grid, step):
            steps[-1].append((tail + step * N, head + (step + 1) * N, cost))
            count += len(tail)
            given = f"angles = {grid.shape[0]} x {grid.shape[1]}"
            require_memory(given, "edges or more in lp's graph", count, EDGE)
    steps.append([(last + (K - 1) * N, np.full(len(last), K * N + 1), np.zeros(len(last)))])
    begins = np.cumsum([0, *(sum(len(part[0]) for part in parts) for parts in steps[:-1])])
    each = zip(*(part for parts in steps for part in parts), strict=True)
    tail, head, cost = (np.concatenate(of) for of in each)
    if threshold is not None:
        worst = (cost >= threshold - slack) + (K + 1.0) * (cost > threshold + slack)
        cost = np.where(head < K * N, worst, 0.0)
    return LayeredGraph(tail, head, cost, begins, N)


class Flow(NamedTuple):
    """A solved linear program: the flow on each edge, a proved bound, and how it ended."""

    edges: np.ndarray | None
    bound: float | None
    status: OptimStatus
    message: str


def solve_flow(graph: LayeredGraph) -> Flow:
    """The linear program; statuses are mapped, and solver errors are FAILED."""
    edges, nodes = len(graph.tail), graph.source + 2
    numbers = np.arange(edges)
    signs = np.concatenate([np.ones(edges), -np.ones(edges)])
    where = (np.concatenate([graph.tail, graph.head]), np.tile(numbers, 2))
    balance = sp.csr_array((signs, where), shape=(nodes, edges))
    supply = np.zeros(nodes)
    supply[-2:] = 1, -1
    f = cp.Variable(edges, nonneg=True)
    conserved: Any = balance @ f == supply
    program = cp.Problem(cp.Minimize(graph.cost @ f), [conserved])
    ended = solve_quietly(program, cp.HIGHS)
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
    bound = y[-1] - y[-2] + np.sum(least)
    # What the sums above may have lost: a rounding of each addend.
    size = np.max(np.abs(y)) + np.max(np.abs(graph.cost))
    return float(bound - 4 * np.finfo(float).eps * size * (len(least) + 1))


def _result(
    grid: PostureGrid, graph: LayeredGraph, flow: Flow, common: dict[str, Any]
) -> PostureResult:
    """The path of the flow, and the grid's bound."""
    problem, bound = grid.problem, common["details"]["grid_bound"]
    chosen, spread = graph.path(np.asarray(flow.edges))
    if chosen is None:
        message = f"{flow.message}; the flow is no path"
        status = OptimStatus.FAILED
        return PostureResult.without_point(status=status, message=message, **common)
    x = grid.angles_at(chosen)
    value = problem.objective(x.reshape(-1))
    ended = flow.status is OptimStatus.OPTIMAL
    status = OptimStatus.FEASIBLE if ended else flow.status
    message = grid.stuck or (OVER_GRID.format(grid.what) if ended else flow.message)
    if not closes(problem, value, bound, GAP):
        status = OptimStatus.INACCURATE if ended else status
        message = f"{flow.message}; value {value!r}, proved bound {bound!r}"
    elif spread > WHOLE:
        status, message = OptimStatus.INACCURATE, f"{flow.message}; off whole numbers by {spread}"
    return problem.result(x, status=status, message=message, **common)
