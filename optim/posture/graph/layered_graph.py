"""The grid as a graph: admissible stations as nodes, moves that the rate allows as edges."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import jax
import numpy as np

from stickslip.dynamics.checks import require_memory
from stickslip.optim.posture.criteria import station_cost, step_cost
from stickslip.optim.posture.graph.posture_grid import PostureGrid, offsets
from stickslip.optim.posture.rounding import slack as slack_of
from stickslip.optim.posture.sizes import EDGE
from stickslip.optim.posture.stations.station import Station

if TYPE_CHECKING:
    from jaxtyping import Float, Int


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


def moves_of_step(grid: PostureGrid, step: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The same in parts, one for each move in grid steps; all at once from or to a given pair."""
    good_a, good_b = grid.admissible(step), grid.admissible(step + 1)
    first, last = grid.free
    if step < first or step + 1 >= last:  # from or to a given pair
        a, b = (grid.layer(k).stations.leg_angles for k in (step, step + 1))
        allowed = grid.within(step, a[:, None], b) & good_a[:, None] & good_b
        tail, head = np.nonzero(allowed)
        yield tail, head
        return
    wide = grid.windows()[step]
    R, F = grid.shape
    good_a, good_b = good_a.reshape(R, F), good_b.reshape(R, F)
    for r, f in offsets(grid):
        if abs(r) > wide[0] or abs(f) > wide[1]:
            continue
        rows, columns = slice(max(0, -r), min(R, R - r)), slice(max(0, -f), min(F, F - f))
        to_rows, to_columns = slice(max(0, r), min(R, R + r)), slice(max(0, f), min(F, F + f))
        i, j = np.nonzero(good_a[rows, columns] & good_b[to_rows, to_columns])
        i, j = i + rows.start, j + columns.start
        yield i * F + j, (i + r) * F + j + f


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
