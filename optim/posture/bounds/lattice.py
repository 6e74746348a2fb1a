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
MOST_CELLS = 256
"""Most cells of a leg at the first level, beyond which cells are no part of the rate."""


@dataclass(frozen=True)
class Axis:
    """A leg's corners at a waypoint [rad], increasing; two for a given angle, all but the same."""

    nodes: Float[np.ndarray, "n"]

    @property
    def widths(self) -> Float[np.ndarray, "n-1"]:
        return np.diff(self.nodes)

    def part(self, cells: slice) -> Axis:
        return Axis(self.nodes[cells.start : cells.stop + 1])

    def halved(self) -> Axis:
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
    """Masks of pairs of cells: where some b - a < limit in more than, and where in
    no more than the half below its diagonal."""
    a0, a1, b0, b1 = a[:-1, None], a[1:, None], b[:-1], b[1:]
    some = b0 - a1 < limit
    half = some & (b0 - a0 >= limit) & (b1 - a1 >= limit)
    return some & ~half, half


Entries = Callable[[np.ndarray], np.ndarray]
"""A function that moves or joins entries."""


class Boxes(NamedTuple):
    """Derivatives of fields over each of n boxes of leg angles; anything where unknown.

    lo, hi: ends [fields, 2, 2, n], of the first and the second derivative along rear and front.
    """

    names: tuple[str, ...]
    lo: Float[np.ndarray, "fields 2 2 n"]
    hi: Float[np.ndarray, "fields 2 2 n"]
    known: Bool[np.ndarray, "n"]
    """False: of postures in the box nothing is known."""
    smooth: Bool[np.ndarray, "n"]
    """False: the second derivatives are none."""

    def derivative(self, name: str, order: int) -> Interval:
        """The first or the second derivative of a field [2, n]."""
        at = self.names.index(name), order - 1
        return Interval(self.lo[at], self.hi[at])

    def map(self, low: Entries, high: Entries | None = None, mask: Entries | None = None) -> Boxes:
        """Functions of the lower ends, of the upper ends and of the masks; the first one of all
        where no other is given."""
        high, mask = high or low, mask or low
        return Boxes(self.names, low(self.lo), high(self.hi), mask(self.known), mask(self.smooth))


def by_parts(of: Callable[[Interval], tuple[Boxes, np.ndarray]], whole: Interval) -> Boxes:
    """Hull over whole boxes [2, n] of their parts, each cut in four until it is narrow enough.

    of: boxes of angles, and about what each field is there, but for a constant [fields, n].
    """
    boxes, middle = of(whole)
    count, widths = boxes.known.size, whole.hi - whole.lo
    scales = np.full(len(middle), FLOOR)
    if np.any(boxes.known):
        scales = np.maximum(np.ptp(middle[:, boxes.known], axis=1), FLOOR)
    cuts, owner, lost = whole, np.arange(count), _lost(boxes, widths, scales)
    for _ in range(CUTS):
        worst = np.zeros(count)
        np.maximum.at(worst, owner, lost)
        poor = (lost > FINE) & (lost >= WORST * worst[owner])
        if not np.any(poor) or owner.size + 3 * np.sum(poor) > PARTS * count + ROOM:
            break
        parts, theirs = _quarters(cuts[:, poor]), np.tile(owner[poor], 4)
        found, _ = of(parts)
        pairs = zip(boxes[1:], found[1:], strict=True)
        boxes = Boxes(boxes.names, *(_after(one, poor, other) for one, other in pairs))
        lost = _after(lost, poor, _lost(found, widths[:, theirs], scales))
        cuts = Interval(_after(cuts.lo, poor, parts.lo), _after(cuts.hi, poor, parts.hi))
        owner = _after(owner, poor, theirs)
    order = np.argsort(owner, kind="stable")
    begin = np.searchsorted(owner[order], np.arange(count))
    least, most, all_ = (
        lambda v, join=join: join.reduceat(v[..., order], begin, -1)
        for join in (np.minimum, np.maximum, np.logical_and)
    )
    return boxes.map(least, most, all_)


def _after(one: np.ndarray, poor: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Entries that are not cut, then those of the parts."""
    return np.concatenate([one[..., ~poor], other], -1)


def _lost(boxes: Boxes, widths: np.ndarray, scales: np.ndarray) -> np.ndarray:
    """Greatest loss in each part, in ranges of the field; infinite where nothing is known.
    widths: of the boxes that they are parts of [2, n]."""
    size = np.maximum(np.abs(boxes.lo), np.abs(boxes.hi))
    straight, curved = widths / 2 * size[:, 0], widths**2 / 8 * size[:, 1]
    lost = np.where(boxes.smooth, np.minimum(curved, straight), straight)
    return np.where(boxes.known, np.max(np.max(lost, 1) / scales[:, None], 0), np.inf)


def _quarters(boxes: Interval) -> Interval:
    """Boxes [2, n] cut in four [2, 4 n]."""
    middle = boxes.lo + (boxes.hi - boxes.lo) / 2
    ends = []
    for low, high in ((boxes.lo, middle), (middle, boxes.hi)):
        pairs = [(rear, front) for rear in (low, high) for front in (low, high)]
        ends.append(np.concatenate([np.stack([r[0], f[1]]) for r, f in pairs], -1))
    return Interval(*ends)
