"""Costs to go and of arriving over corners of cells, with lowered costs: they bound every drive.

With V at the corners such that V(a) <= c(a, b) + V(b) for every pair of corners of a step, the
interpolant of V is below the cost of every drive from any point of the cells on (lowered.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.optim.posture.bounds.lattice import moves
from stickslip.optim.posture.bounds.lowered import StepCosts, Term, step_costs

if TYPE_CHECKING:
    from jaxtyping import Bool, Float

    from stickslip.optim.posture.bounds.station_cells import StationCells
    from stickslip.optim.posture.data import PostureData


class Step(NamedTuple):
    """A step: the costs of its moves, and which corners each leg may move between."""

    costs: StepCosts
    rear: Bool[np.ndarray, "n m"]
    front: Bool[np.ndarray, "n m"]
    box_a: tuple[slice, slice]
    """The corners before it that count lie in here; box_b: after it."""
    box_b: tuple[slice, slice]

    def parts(self) -> Iterator[tuple[tuple, tuple, np.ndarray]]:
        """Corners before, corners after and which of their pairs count, as slices of one shape."""
        for rear_a, rear_b, rear_ok in _diagonals(self.rear, self.box_a[0], self.box_b[0]):
            for front_a, front_b, front_ok in _diagonals(self.front, self.box_a[1], self.box_b[1]):
                yield (rear_a, front_a), (rear_b, front_b), rear_ok[:, None] & front_ok


def _diagonals(
    allowed: np.ndarray, box_a: slice, box_b: slice
) -> Iterator[tuple[slice, slice, np.ndarray]]:
    """The diagonals of a matrix that hold anything, within rows and columns."""
    for by in range(box_b.start - box_a.stop + 1, box_b.stop - box_a.start):
        first = max(box_a.start, box_b.start - by)
        past = min(box_a.stop, box_b.stop - by)
        if past <= first:
            continue
        ok = allowed[np.arange(first, past), np.arange(first, past) + by]
        if np.any(ok):
            yield slice(first, past), slice(first + by, past + by), ok


def _box(corners: np.ndarray) -> tuple[slice, slice]:
    """The least rectangle that holds them all."""
    rows, columns = np.nonzero(corners)
    if not len(rows):
        return slice(0, 0), slice(0, 0)
    return slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1)


def make_step(
    problem: PostureData,
    terms: list[Term],
    k: int,
    a: StationCells,
    b: StationCells,
    shares: list[float],
) -> Step:
    """The step from waypoint k."""
    rear, front = moves(problem, k, a.rear, b.rear), moves(problem, k, a.front, b.front)
    reach = None
    if problem.leg_rate is not None:
        reach = (_reach(rear), _reach(front))
    costs = step_costs(problem, terms, k, (a, b), reach, shares)
    return Step(costs, rear, front, _box(a.corners), _box(b.corners))


def _reach(allowed: np.ndarray) -> int:
    """The longest move, in corners."""
    rows, columns = np.nonzero(allowed)
    return int(np.max(np.abs(rows - columns), initial=0))


def back(step: Step, after: Float[np.ndarray, "R F"], corners: np.ndarray) -> np.ndarray:
    """Costs to go at the corners before a step, from those after it."""
    best = np.full(corners.shape, np.inf)
    for a, b, ok in step.parts():
        total = step.costs.between(a, b) + after[b]
        np.minimum(best[a], np.where(ok, total, np.inf), out=best[a])
    return np.where(corners, best, np.inf)


def on(step: Step, before: Float[np.ndarray, "R F"], corners: np.ndarray) -> np.ndarray:
    """Costs of arriving at the corners after a step, from those before it."""
    best = np.full(corners.shape, np.inf)
    for a, b, ok in step.parts():
        total = step.costs.between(a, b) + before[a]
        np.minimum(best[b], np.where(ok, total, np.inf), out=best[b])
    return np.where(corners, best, np.inf)


def missed(step: Step, before: np.ndarray, after: np.ndarray) -> float:
    """By how much V(a) <= c(a, b) + V(b) is missed at worst, looked up for every pair anew."""
    worst = 0.0
    for a, b, ok in step.parts():
        go_on = after[b]
        counts = ok & np.isfinite(go_on)
        with np.errstate(invalid="ignore"):
            short = before[a] - (step.costs.between(a, b) + go_on)
        short = short[counts & np.isfinite(before[a])]
        worst = max(worst, float(np.max(short, initial=0.0)))
    return worst
