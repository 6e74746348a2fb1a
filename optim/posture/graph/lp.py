"""The best path over the grid as a flow, a linear program in cvxpy whose dual certifies it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import cvxpy as cp
import numpy as np
import scipy.sparse as sp

from stickslip.dynamics.checks import require_memory
from stickslip.optim.cvx import Ended, solve_quietly
from stickslip.optim.posture.graph.grid import build_grid, polished
from stickslip.optim.posture.graph.search import OVER_GRID, best_paths, costed_edges
from stickslip.optim.posture.result import PostureResult, below, closes
from stickslip.optim.posture.waypoints import EDGE
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from jaxtyping import Float, Int

    from stickslip.optim.posture.graph.grid import PostureGrid
    from stickslip.optim.posture.problem import PostureProblem

GAP = 1e-6
"""Relative gap between value and bound up to which the path counts as proved optimal."""


def solve_lp(
    problem: PostureProblem,
    *,
    progress: bool = False,
    polish: bool = False,
    angles: Any = None,
    least: int = 11,
) -> PostureResult:
    """dp's optimum as a flow of 1 through the graph of admissible stations and moves, for sums.

    minimise sum of c_e f_e, f >= 0, as much out of each node as into it. The matrix is totally
    unimodular, so a basic solution is a path. With y the dual values as potentials of the nodes, 0
    at both ends, a path costs the sum of the reduced costs c_e - (y_head - y_tail) of its edges, of
    which one is of each step: the sum over steps of the least reduced cost there is below every
    path's cost whatever y is. That is computed in NumPy from y alone and is the grid's bound, less
    what rounding may do to the stations (`below`), the solver trusted in nothing. INACCURATE where
    it is not within 1e-6 of the value, nor within 1e-12 of what the vehicle's weight would give.
    lower_bound is None, and without a path it ends, as dp's does. ValueError for a worst station.

    angles, least: of the grid, as in dp. evaluations: stations. details: grid, rate_used,
    grid_bound (None: not proved), edges. polish: see `polished`.
    """
    if problem.criterion.kind != "sum":
        raise ValueError(
            f"criterion = {problem.criterion.name} holds a worst station; accepted by 'lp': sums "
            "over steps ('dp' takes a worst station)"
        )

    def search() -> PostureResult:
        grid = build_grid(problem, angles, least, "lp", progress)
        paths = best_paths(grid)
        if paths.nodes is None:
            return grid.without_path(paths.stuck_at, paths.reason)
        return _result(grid, edges_of(grid))

    return polished(problem, polish, progress, search)


@dataclass(frozen=True)
class Edges:
    """All edges of a grid, sorted by the step of the drive that they belong to.

    Nodes are numbered waypoint by waypoint, N of them each. begins: where the edges of each step
    begin.
    """

    tail: Int[np.ndarray, "E"]
    head: Int[np.ndarray, "E"]
    cost: Float[np.ndarray, "E"]
    begins: Int[np.ndarray, "K-1"]
    N: int

    def path(self, flow: np.ndarray) -> np.ndarray | None:
        """The nodes [K] on the edges that carry most; None where these edges do not join."""
        steps = np.split(flow, self.begins[1:])
        edges = self.begins + np.array([int(np.argmax(of)) for of in steps])
        if np.any(self.head[edges[:-1]] != self.tail[edges[1:]]):
            return None
        return np.append(self.tail[edges], self.head[edges[-1]]) % self.N

    def bound(self, y: Float[np.ndarray, "nodes"]) -> float:
        """A lower bound of every path's cost from any potentials of the nodes between the ends."""
        y = np.concatenate([np.zeros(self.N), y, np.zeros(self.N)])
        reduced = self.cost - (y[self.head] - y[self.tail])
        # What the sums may lose: a rounding of each addend.
        size = np.max(np.abs(y)) + np.max(np.abs(self.cost))
        rounding = 4 * np.finfo(float).eps * size * (len(self.begins) + 1)
        return float(np.sum(np.minimum.reduceat(reduced, self.begins)) - rounding)


def edges_of(grid: PostureGrid) -> Edges:
    """All edges with their costs; ValueError for more than fit."""
    N = grid.shape[0] * grid.shape[1]
    parts, begins, count = [], [], 0
    for step in range(len(grid.layers) - 1):
        begins.append(count)
        for tail, head, cost in costed_edges(grid, step):
            parts.append((tail + step * N, head + (step + 1) * N, cost))
            count += len(tail)
            given = f"angles = {grid.shape[0]} x {grid.shape[1]}"
            require_memory(given, "edges or more in lp's graph", count, EDGE)
    tail, head, cost = (np.concatenate(of) for of in zip(*parts, strict=True))
    return Edges(tail, head, cost, np.array(begins), N)


def solve_flow(edges: Edges) -> tuple[np.ndarray | None, float | None, Ended]:
    """The linear program: the flow on each edge, a proved bound, and how it ended."""
    count, last, N = len(edges.tail), len(edges.begins) * edges.N, edges.N
    f = cp.Variable(count, nonneg=True)
    signs = np.concatenate([np.ones(count), -np.ones(count)])
    where = np.concatenate([edges.tail, edges.head]), np.tile(np.arange(count), 2)
    balance: Any = sp.csr_array((signs, where), shape=(last + N, count))[N:last] @ f == 0
    first = np.append(edges.begins, count)[1]
    constraints = [cp.sum(f[:first]) == 1, *([balance] if last > N else [])]
    program = cp.Problem(cp.Minimize(edges.cost @ f), constraints)
    ended = solve_quietly(program, cp.HIGHS)
    if f.value is None or not ended.answered:  # the flow is known to be feasible
        return None, None, ended._replace(status=OptimStatus.FAILED)
    bound = None
    y = balance.dual_value if last > N else np.zeros(0)
    if y is not None:  # which sign the solver's interface gives it is not relied on
        bound = max(edges.bound(y), edges.bound(-y))
    return np.asarray(f.value), bound, ended


def _result(grid: PostureGrid, edges: Edges) -> PostureResult:
    """The path of the flow, and the grid's bound."""
    problem = grid.problem
    flow, bound, ended = solve_flow(edges)
    nodes = None if flow is None else edges.path(flow)
    if nodes is None:
        why = ended.message if flow is None else f"{ended.message}; the flow is no path"
        return grid.without_answer(why)
    bound = None if bound is None else below(problem, bound)
    value = problem.objective(grid.angles_at(nodes).reshape(-1))
    optimal = ended.status is OptimStatus.OPTIMAL
    status = OptimStatus.FEASIBLE if optimal else ended.status
    message = grid.stuck or (OVER_GRID.format(grid.what) if optimal else ended.message)
    if not closes(problem, value, bound, GAP):
        status = OptimStatus.INACCURATE if optimal else status
        message = f"{ended.message}; value {value!r}, proved bound {bound!r}"
    return grid.result(nodes, status, message, grid_bound=bound, edges=len(edges.tail))
