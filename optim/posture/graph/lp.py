"""The best path over the grid as a flow, a linear program in cvxpy whose dual certifies it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import cvxpy as cp
import numpy as np
import scipy.sparse as sp

from stickslip.dynamics.checks import require_choice, require_integer
from stickslip.optim.cvx import solve_quietly
from stickslip.optim.options import COUNT
from stickslip.optim.posture.finish import result_at
from stickslip.optim.posture.graph.dp import OVER_GRID, angles_at, best_paths, require_one_kind
from stickslip.optim.posture.graph.impossible import without_path
from stickslip.optim.posture.graph.layered_graph import LayeredGraph, build_graph
from stickslip.optim.posture.graph.posture_grid import build_grid
from stickslip.optim.posture.local.polish import polishable
from stickslip.optim.posture.result import PostureResult
from stickslip.optim.posture.rounding import below, closes
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from stickslip.optim.posture.graph.posture_grid import PostureGrid
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
        return Flow(None, None, OptimStatus.FAILED, ended.words)
    bound = None
    if conserved.dual_value is not None:
        # Which sign the solver's interface gives the dual is not relied on: either is a bound.
        bound = max(proved_bound(graph, y) for y in (conserved.dual_value, -conserved.dual_value))
    return Flow(np.asarray(f.value), bound, ended.status, ended.words)


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
