"""Costs of a step between corners of cells, lowered so that they bound every move between.

A term of a step from a to b is p = (X_a + X_b) (Y_b - Y_a) / 2: torque and turn of the wheels, or
of a leg. Over the moves between given corners (lattice.py) p lies above its interpolant of the
corners less

    kappa = sum over both legs of h^2 / 8 (max(p_aa, 0) + max(p_bb, p_aa + 2 p_ab + p_bb, 0)),

the second term along the triangles' diagonals; derivatives are enclosed over whole cells, h is a
cell's width. What is paid is max(0, p) >= share p for any share from 0 to 1. With w the range of p
over the corners that one move may lie between,

    c = p - kappa  where p >= w + kappa,   0  where p <= -w,   share (p - kappa)  between,

has an interpolant that no move between the corners costs less than: if the first holds at one of
them, p >= kappa at all, so that share (p - kappa) <= p - kappa; if the second does, p <= 0 at all;
else it is share (p - kappa) at all. Which share is best is the multiplier of a kink of the cost,
and is looked for (shares.py); any is a bound. Squares of differences, (X_b - X_a)^2 / dx, lose
their variance over the corners, w^2 / 4 at most, and 2 |X_b - X_a| kappa.

Every kappa and w is the sum of one number for each end of the step, the largest of the cells about
that corner and of all that the other end may be.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from stickslip.optim.intervals.interval import Interval, interval
from stickslip.optim.posture.bounds.station_cells import at_corners, of_corners
from stickslip.optim.posture.criteria import Criterion, Weighted

if TYPE_CHECKING:
    Index: TypeAlias = "tuple[slice, slice] | tuple[np.ndarray, np.ndarray] | tuple[int, int]"
    from stickslip.optim.posture.bounds.station_cells import StationCells
    from stickslip.optim.posture.data import PostureData

TOO_MUCH = 0.5
"""Of what p may be at most: a cell whose kappa is more is charged nothing at all."""
SLACK = 1e-9
"""Of each loss: for the rounding of what is computed beside interval arithmetic."""


class Term(NamedTuple):
    """weight * max(0, p), or weight * (X_b - X_a)^2 where Y is None."""

    weight: float
    X: str
    Y: str | None


PAIRS = {
    "wheel_energy": (("torque", "turn"),),
    "total_energy": (("torque", "turn"), ("leg_rear", "rear"), ("leg_front", "front")),
    "torque_variation": (("torque", None),),
}


def terms_of(criterion: Criterion | Weighted) -> list[Term]:
    """The terms of a sum over steps; ValueError for a criterion that has no such form here."""
    parts = criterion.parts if isinstance(criterion, Weighted) else ((criterion, 1.0),)
    found = []
    for one, weight in parts:
        if one.name not in PAIRS:
            raise ValueError(
                f"criterion = {criterion.name}; accepted: {', '.join(PAIRS)}, their weighted sums, "
                "and single worst stations"
            )
        found += [Term(float(np.asarray(weight)), X, Y) for X, Y in PAIRS[one.name]]
    return [term for term in found if term.weight > 0]


class End(NamedTuple):
    """One end of a step: at the corners X, Y and what is lost; doubt: corners of a cell of which so
    little is known that 0 is all that is charged there."""

    X: np.ndarray
    Y: np.ndarray
    kappa: np.ndarray
    spread: np.ndarray
    doubt: np.ndarray


@dataclass(frozen=True)
class StepCosts:
    """The lowered costs of one step."""

    terms: list[Term]
    ends: list[tuple[End, End]]
    shares: list[float]
    dx: float
    slack: float
    """What rounding of the corners' values may take off besides."""

    def between(self, a: Index, b: Index) -> np.ndarray:
        """Of the moves from the corners a to the corners b, indices of one shape."""
        total = np.zeros(())
        for number, (term, share) in enumerate(zip(self.terms, self.shares, strict=True)):
            p, spread, kappa = self.look(number, a, b)
            if term.Y is None:
                rise = np.abs(p)
                cost = (rise * (rise - 2 * kappa) - spread * spread / 4) / self.dx
            else:
                part = np.where(p < spread + kappa, share, 1.0)
                cost = np.where(p <= -spread, 0.0, part * (p - kappa))
            one, other = self.ends[number]
            cost = np.where(one.doubt[a] | other.doubt[b], np.minimum(cost, 0.0), cost)
            total = total + term.weight * cost
        return total

    def look(self, number: int, a: Index, b: Index) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """p of a term (or what is squared), its range w and kappa."""
        one, other = self.ends[number]
        if self.terms[number].Y is None:
            p = other.X[b] - one.X[a]
        else:
            p = (one.X[a] + other.X[b]) * (other.Y[b] - one.Y[a]) / 2
        return p, one.spread[a] + other.spread[b], one.kappa[a] + other.kappa[b]


def step_costs(
    problem: PostureData,
    terms: list[Term],
    k: int,
    cells: tuple[StationCells, StationCells],
    reach: tuple[int, int] | None,
    shares: list[float],
) -> StepCosts:
    """Those of step k. reach: how many corners the legs may go at most; None: any."""
    a, b = cells
    dx = float(problem.x[k + 1] - problem.x[k])
    ends, slack = [], 0.0
    for term in terms:
        one, other, rounding = _ends(term, a, b, reach)
        ends.append((one, other))
        slack += term.weight * rounding / (dx if term.Y is None else 1.0)
    return StepCosts(terms, ends, shares, dx, slack)


class _Quantity(NamedTuple):
    """A field at one end: corners, over each cell, and derivatives of each leg over each cell."""

    corners: np.ndarray
    cells: Interval
    first: list[Interval]
    second: list[Interval]
    radius: float


def _quantity(of: StationCells, name: str) -> _Quantity:
    known = of.inside.known
    shape = of.alive.shape
    if name in ("rear", "front"):
        leg = int(name == "front")
        nodes = (of.rear, of.front)[leg].nodes
        along = nodes[:, None] if leg == 0 else nodes[None, :]
        corners = np.broadcast_to(along, (shape[0] + 1, shape[1] + 1)).copy()
        zero, one = interval(np.zeros(shape)), interval(np.ones(shape))
        first = [one if d == leg else zero for d in (0, 1)]
        cells = Interval(of_corners(corners, np.minimum), of_corners(corners, np.maximum))
        return _Quantity(corners, cells, first, [zero, zero], 0.0)
    first, second = (
        [part[name][d].map(lambda v: np.where(known, v, 0.0)) for d in (0, 1)]
        for part in (of.inside.first, of.inside.second)
    )
    cells = of.range_of(name).map(lambda v: np.where(known & of.alive, v, 0.0))
    corners, radius = of.values[name], of.radii[name]
    return _Quantity(corners, cells, first, second, radius)


def _ends(
    term: Term,
    a: StationCells,
    b: StationCells,
    reach: tuple[int, int] | None,
) -> tuple[End, End, float]:
    Xa, Xb = (_quantity(of, term.X) for of in (a, b))
    if term.Y is None:
        return _of_square(a, b, Xa, Xb)
    Ya, Yb = (_quantity(of, term.Y) for of in (a, b))
    sound_a, sound_b = _sound(a, Xa), _sound(b, Xb)
    near_a, near_b = _Near(a, b, reach, sound_b), _Near(b, a, reach, sound_a)
    ends, spreads = [], []
    for here, there, sound, X, Y, Z, V, sign in (
        (a, near_a, sound_a, Xa, Ya, Xb, Yb, -1.0),
        (b, near_b, sound_b, Xb, Yb, Xa, Ya, 1.0),
    ):
        other_X, other_Y = there(Z.cells), there(V.cells)
        mean = (X.cells + other_X) * 0.5
        way = (Y.cells - other_Y) * sign
        kappa = np.zeros(here.alive.shape)
        for leg, h in enumerate((here.rear.widths[:, None], here.front.widths)):
            bend = X.second[leg] * way * 0.5
            bend = bend + (X.first[leg] * Y.first[leg] + mean * Y.second[leg]) * sign
            worst = np.maximum(bend.hi, 0.0)
            if sign > 0:
                along = _diagonal(leg, X, Y, mean, way, there, Z, V)
                worst = np.maximum(worst, along)
            slope = X.first[leg].size * way.size * 0.5 + mean.size * Y.first[leg].size
            curved, straight = h**2 / 8 * worst, h / 2 * slope
            smooth = here.inside.smooth
            kappa += np.where(smooth, np.minimum(curved, straight), straight)
        range_X, range_Y = (_range(of.corners) for of in (X, Y))
        spread = range_X * way.size * 0.5 + mean.size * range_Y
        sound = sound & (kappa <= TOO_MUCH * mean.size * way.size)
        doubt = at_corners(here.alive & ~sound, np.any)
        kappa, spread = _largest(sound, kappa), _largest(sound, spread)
        ends.append(End(X.corners, Y.corners, kappa, spread, doubt))
        spreads.append((mean.size, way.size))
    rounding = _rounding(a, Xa.radius + Xb.radius, Ya.radius + Yb.radius, spreads[0])
    return ends[0], ends[1], rounding


def _rounding(a: StationCells, X: float, Y: float, sizes: tuple[np.ndarray, np.ndarray]) -> float:
    """What a step's p may be off by, from the radii of its corners' values."""
    mean, way = (float(np.max(of, where=a.alive, initial=0.0)) for of in sizes)
    return 1.01 * (X * way / 2 + mean * Y + X * Y)


def _diagonal(
    leg: int,
    X: _Quantity,
    Y: _Quantity,
    mean: Interval,
    way: Interval,
    there: _Near,
    Z: _Quantity,
    V: _Quantity,
) -> np.ndarray:
    """The second derivative of p along both ends moving alike: where a triangle is cut."""
    second = (X.second[leg] + there(Z.second[leg])) * way * 0.5
    first = (X.first[leg] + there(Z.first[leg])) * (Y.first[leg] - there(V.first[leg]))
    return np.maximum((second + first + mean * (Y.second[leg] - there(V.second[leg]))).hi, 0.0)


def _of_square(
    a: StationCells, b: StationCells, Xa: _Quantity, Xb: _Quantity
) -> tuple[End, End, float]:
    ends = []
    for here, X in ((a, Xa), (b, Xb)):
        kappa = np.zeros(here.alive.shape)
        for leg, h in enumerate((here.rear.widths[:, None], here.front.widths)):
            curved, straight = h**2 / 8 * X.second[leg].size, h / 2 * X.first[leg].size
            smooth = here.inside.smooth
            kappa += np.where(smooth, np.minimum(curved, straight), straight)
        sound = here.alive & here.inside.known
        doubt = at_corners(here.alive & ~sound, np.any)
        kappa, spread = _largest(sound, kappa), _largest(sound, _range(X.corners))
        ends.append(End(X.corners, X.corners, kappa, spread, doubt))
    rise = float(np.max(Xa.cells.size)) + float(np.max(Xb.cells.size))
    radius = Xa.radius + Xb.radius
    return ends[0], ends[1], 1.01 * radius * (2 * rise + radius)


def _range(corners: np.ndarray) -> np.ndarray:
    """Of each cell, over its corners."""
    return of_corners(corners, np.maximum) - of_corners(corners, np.minimum)


def _sound(of: StationCells, X: _Quantity) -> np.ndarray:
    """Cells in which X is known better than that it may be anything, of either sign."""
    largest = of_corners(np.abs(X.corners), np.maximum)
    return of.alive & of.inside.known & (X.cells.size <= 3 * largest)


def _largest(counts: np.ndarray, losses: np.ndarray) -> np.ndarray:
    """At each corner, of the cells about it that count; 0 where none does."""
    found = at_corners(np.where(counts, losses * (1 + SLACK), -np.inf), np.max)
    return np.maximum(found, 0.0)


class _Near:
    """The hull of what the other end of a step may be, for each cell of this end."""

    def __init__(
        self,
        here: StationCells,
        there: StationCells,
        reach: tuple[int, int] | None,
        counts: np.ndarray,
    ):
        self.shape = here.alive.shape
        same = here.alive.shape == there.alive.shape
        self.size = None if reach is None or not same else tuple(2 * (n + 1) + 1 for n in reach)
        self.counts = counts

    def __call__(self, of: Interval) -> Interval:
        low = np.where(self.counts, of.lo, np.inf)
        high = np.where(self.counts, of.hi, -np.inf)
        if self.size is None:
            low, high = (np.full(self.shape, v) for v in (np.min(low), np.max(high)))
        else:
            low = minimum_filter(low, self.size, mode="nearest")
            high = maximum_filter(high, self.size, mode="nearest")
        none = low > high
        return Interval(np.where(none, 0.0, low), np.where(none, 0.0, high))
