"""Costs of arriving as potentials, which bound all paths over a grid, verified edge by edge.

Take any number y for every node. Where y_head - y_tail <= cost for every edge, no path costs less
than y at its end less y where it began: the dual of the shortest path, without a linear program.
Where an edge misses that by something, the bound is lower by the worst miss of its step.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.optim.posture.criteria import Criterion, Weighted, station_cost, step_cost
from stickslip.optim.posture.graph.layered_graph import moves_of_step
from stickslip.optim.posture.stations.station import Station

if TYPE_CHECKING:
    from jaxtyping import Array, Int

    from stickslip.optim.posture.graph.posture_grid import PostureGrid

    Edges = tuple[np.ndarray, np.ndarray]
    """Nodes before and after each."""

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


def _together(parts: Iterator[Edges]) -> Iterator[Edges]:
    """The same edges, about EDGES at a time; none that are empty."""
    waiting: list[Edges] = []
    count = 0
    for part in parts:
        waiting.append(part)
        count += len(part[0])
        if count >= EDGES:
            yield _joined(waiting)
            waiting, count = [], 0
    if count:
        yield _joined(waiting)


def _joined(parts: list[Edges]) -> Edges:
    tail, head = (np.concatenate(of) for of in zip(*parts, strict=True))
    return tail, head


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
