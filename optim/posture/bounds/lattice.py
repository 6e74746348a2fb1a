"""Cells of leg angles: where they are cut, and which corners a move within the rate lies between.

Take a leg at a in a cell I and, a waypoint later, at b in a cell J, with |b - a| <= what the rate
allows. Where the cells are a whole part of that long, the (a, b) that are allowed are a union of
squares I x J, all of whose corners are allowed moves, and of triangles, halves of squares cut along
the diagonal b - a = limit, whose three corners are. So a function over the allowed moves that lies
above its interpolant of these corners (less something known) is bounded by its values there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.optim.intervals import Interval
from stickslip.optim.problem import FEASIBLE

if TYPE_CHECKING:
    from jaxtyping import Bool, Float, Int

    from stickslip.optim.posture.waypoints import PostureData

NONE, SQUARE, AHEAD, BACK = range(4)
FINE = 4e-3
"""A box is cut until what its second derivatives take off its corners' interpolant, or its first
ones, is less than this part of the field's range, or until there were CUTS turns."""
CUTS = 2
WORST = 0.6
"""Parts that lose more than this share of what the worst part of their box does are cut."""
PARTS = 16
"""Greatest average number of parts of a box, with ROOM besides, beyond which none is cut."""
ROOM = 2_000
FLOOR = 1e-3
"""Least range of a field, in its unit."""
Angles = tuple[Interval, Interval]
"""Angles of both legs [rad]."""
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


class Boxes(NamedTuple):
    """Derivatives of each field over each box [2, n], along rear and front; anything if unknown."""

    middle: dict[str, Float[np.ndarray, "n"]]
    """About what a field is there, but for a constant."""
    first: dict[str, Interval]
    second: dict[str, Interval]
    known: Bool[np.ndarray, "n"]
    """False: of postures in the box nothing is known."""
    smooth: Bool[np.ndarray, "n"]
    """False: the second derivatives are none."""


def by_parts(of: Callable[[Angles], Boxes], whole: Angles) -> Boxes:
    """Hull over whole boxes of their parts, each cut in four until it is narrow enough."""
    boxes = of(whole)
    widths = np.stack([box.hi - box.lo for box in whole])
    count = boxes.known.size
    scales = {name: _range(value, boxes.known) for name, value in boxes.middle.items()}
    cuts, owner, lost = whole, np.arange(count), _lost(boxes, widths, scales)
    for _ in range(CUTS):
        worst = np.zeros(count)
        np.maximum.at(worst, owner, lost)
        poor = (lost > FINE) & (lost >= WORST * worst[owner])
        if not np.any(poor) or owner.size + 3 * np.sum(poor) > PARTS * count + ROOM:
            break
        parts, theirs = _quarters(cuts, poor), np.tile(owner[poor], 4)
        found = of(parts)
        boxes = _both(_some(boxes, ~poor), found)
        lost = np.concatenate([lost[~poor], _lost(found, widths[:, theirs], scales)])
        cuts = (_after(cuts[0][~poor], parts[0]), _after(cuts[1][~poor], parts[1]))
        owner = np.concatenate([owner[~poor], theirs])
    return _joined(boxes, owner, count)


def _range(value: np.ndarray, known: np.ndarray) -> float:
    return max(float(np.ptp(value[known])) if np.any(known) else 0.0, FLOOR)


def _lost(boxes: Boxes, widths: np.ndarray, scales: dict[str, float]) -> np.ndarray:
    """Greatest loss in each part, in ranges of the field; infinite where nothing is known.
    widths: of the boxes that they are parts of [2, n]."""
    worst = np.zeros(boxes.known.shape)
    for name, scale in scales.items():
        curved = widths**2 / 8 * boxes.second[name].size
        straight = widths / 2 * boxes.first[name].size
        lost = np.where(boxes.smooth, np.minimum(curved, straight), straight)
        worst = np.maximum(worst, np.max(lost, axis=0) / scale)
    return np.where(boxes.known, worst, np.inf)


def _quarters(boxes: Angles, which: np.ndarray) -> Angles:
    parts = []
    for box in boxes:
        lo, hi = box.lo[which], box.hi[which]
        middle = lo + (hi - lo) / 2
        parts.append((Interval(lo, middle), Interval(middle, hi)))
    pairs = [(rear, front) for rear in parts[0] for front in parts[1]]
    rear, front = (
        Interval(np.concatenate([one[leg].lo for one in pairs]),
                 np.concatenate([one[leg].hi for one in pairs]))
        for leg in (0, 1)
    )  # fmt: skip
    return rear, front


def _after(one: Interval, other: Interval) -> Interval:
    return Interval(*(np.concatenate([getattr(of, end) for of in (one, other)], -1)
                      for end in ("lo", "hi")))  # fmt: skip


def _some(boxes: Boxes, which: np.ndarray) -> Boxes:
    first, second = (
        {name: one.map(lambda v: v[:, which]) for name, one in of.items()}
        for of in (boxes.first, boxes.second)
    )
    middle = {name: of[which] for name, of in boxes.middle.items()}
    return Boxes(middle, first, second, boxes.known[which], boxes.smooth[which])


def _both(boxes: Boxes, more: Boxes) -> Boxes:
    """The ones and the others."""
    first, second = (
        {name: _after(one, other[name]) for name, one in of.items()}
        for of, other in ((boxes.first, more.first), (boxes.second, more.second))
    )
    middle = {name: np.concatenate([of, more.middle[name]]) for name, of in boxes.middle.items()}
    known, smooth = (
        np.concatenate([getattr(boxes, name), getattr(more, name)]) for name in ("known", "smooth")
    )
    return Boxes(middle, first, second, known, smooth)


def _joined(parts: Boxes, owner: np.ndarray, count: int) -> Boxes:
    """The hull of each box's parts."""
    order = np.argsort(owner, kind="stable")
    begin = np.searchsorted(owner[order], np.arange(count))

    def hull(of: Interval) -> Interval:
        lo, hi = of.lo[:, order], of.hi[:, order]
        return Interval(np.minimum.reduceat(lo, begin, 1), np.maximum.reduceat(hi, begin, 1))

    first, second = (
        {name: hull(one) for name, one in of.items()} for of in (parts.first, parts.second)
    )
    known, smooth = (
        np.logical_and.reduceat(of[order], begin) for of in (parts.known, parts.smooth)
    )
    middle = {name: of[order][begin] for name, of in parts.middle.items()}
    return Boxes(middle, first, second, known, smooth)
