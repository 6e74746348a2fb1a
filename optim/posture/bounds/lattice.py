"""Cells of leg angles: where they are cut, and which corners a move within the rate lies between.

Take a leg at a in a cell I and, a waypoint later, at b in a cell J, with |b - a| <= what the rate
allows. Where the cells are a whole part of that long, the (a, b) that are allowed are a union of
squares I x J, all of whose corners are allowed moves, and of triangles, halves of squares cut along
the diagonal b - a = limit, whose three corners are. So a function over the allowed moves that lies
above its interpolant of these corners (less something known) is bounded by its values there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.problem import FEASIBLE

if TYPE_CHECKING:
    from jaxtyping import Bool, Float, Int

    from stickslip.optim.posture.stations.data import PostureData

ROOM = 2.0
"""Excess of allowed moves, in units of FEASIBLE, over those that a drive that counts as feasible
may make."""
NONE, SQUARE, AHEAD, BACK = range(4)
MOST_CELLS = 256
"""Most cells of a leg at the first level, beyond which cells are no part of the rate."""


@dataclass(frozen=True)
class Axis:
    """A leg's corners at a waypoint [rad], increasing; two for a given angle, all but the same."""

    nodes: Float[np.ndarray, "n"]

    @property
    def widths(self) -> Float[np.ndarray, "n-1"]:
        """Widths of its cells [rad]."""
        return np.diff(self.nodes)

    def part(self, cells: slice) -> Axis:
        """The corners of a run of cells."""
        return Axis(self.nodes[cells.start : cells.stop + 1])

    def halved(self) -> Axis:
        """Every cell cut in two."""
        middles = self.nodes[:-1] + np.diff(self.nodes) / 2
        both = np.empty(2 * len(self.nodes) - 1)
        both[::2], both[1::2] = self.nodes, middles
        return Axis(both)


def first_axis(problem: PostureData, leg: int, cells: int) -> Axis:
    """About so many cells of a leg over its range, a whole part of what the rate allows."""
    low = float(problem.params.leg_angle_min) - FEASIBLE
    high = float(problem.params.leg_angle_max) + FEASIBLE
    even = Axis(np.linspace(low, high, cells + 1))
    if problem.leg_rate is None:
        return even
    limit = _limit(problem, float(np.min(np.diff(problem.x)))) * (1 + FEASIBLE)
    if limit > high - low or limit < (high - low) / MOST_CELLS:
        return even
    step = limit / np.ceil(limit * cells / (high - low))
    given = [of for of in (problem.start_angles, problem.end_angles) if of is not None]
    anchor = float(given[0][leg]) if given else (low + high) / 2
    first, last = np.ceil((low - anchor) / step), np.floor((high - anchor) / step)
    inner = anchor + step * np.arange(first, last + 1)
    inner = inner[(inner > low + 1e-6 * step) & (inner < high - 1e-6 * step)]
    return Axis(np.concatenate([[low], inner, [high]]))


def given_axis(angle: float) -> Axis:
    """Axis of a given angle, within the tolerance of a feasible drive."""
    return Axis(np.array([angle - FEASIBLE, angle + FEASIBLE]))


def _limit(problem: PostureData, dx: float) -> float:
    """Greatest turn of a feasible drive in a step [rad]."""
    return float(problem.leg_rate or np.inf) * dx * (1 + FEASIBLE)


def moves(problem: PostureData, step: int, a: Axis, b: Axis) -> Bool[np.ndarray, "n m"]:
    """Pairs of corners, before and after a step, between which allowed moves lie."""
    if problem.leg_rate is None:
        return np.ones((len(a.nodes), len(b.nodes)), bool)
    pairs = shapes(problem, step, a, b)
    allowed = np.zeros((len(a.nodes), len(b.nodes)), bool)
    for i in (0, 1):
        for j in (0, 1):
            corner = (pairs == SQUARE) | ((pairs == AHEAD) & ((i, j) != (0, 1)))
            corner |= (pairs == BACK) & ((i, j) != (1, 0))
            allowed[i : i + corner.shape[0], j : j + corner.shape[1]] |= corner
    return allowed


def shapes(problem: PostureData, step: int, a: Axis, b: Axis) -> Int[np.ndarray, "n-1 m-1"]:
    """Shape of the allowed moves of each pair of cells, before and after a step: NONE are, all
    of the SQUARE, or the triangle without the longest move AHEAD, or BACK."""
    if problem.leg_rate is None:
        return np.full((len(a.nodes) - 1, len(b.nodes) - 1), SQUARE)
    limit = _limit(problem, float(problem.x[step + 1] - problem.x[step]))
    ahead, ahead_half = _one_way(a.nodes, b.nodes, limit)
    back, back_half = (of[::-1, ::-1] for of in _one_way(-a.nodes[::-1], -b.nodes[::-1], limit))
    square = (ahead & back) | (ahead_half & back_half)  # cut at both sides: taken whole
    cases = [square, ahead_half & back, back_half & ahead]
    return np.select(cases, [SQUARE, AHEAD, BACK], NONE)


def _one_way(a: np.ndarray, b: np.ndarray, limit: float) -> tuple[np.ndarray, np.ndarray]:
    """Of each pair of cells, whether some b - a < limit in it; and, apart, whether that holds in
    no more than the half below its diagonal."""
    a0, a1, b0, b1 = a[:-1, None], a[1:, None], b[:-1], b[1:]
    some = b0 - a1 < limit
    half = some & (b0 - a0 >= limit) & (b1 - a1 >= limit)
    return some & ~half, half
