"""Costs of steps between the cells of two waypoints: what they are not below.

A term of a step from a to b is max(down p, up p), p = (X_a + X_b) (Y_b - Y_a) / 2: torque and turn
of the wheels, or of a leg. Where Y is None it is p^2 / dx, p = X_b - X_a; or, of the legs' heat,
heat dx (X_a^2 + X_b^2) / 2, which is heat dx p^2, p = (X_a + X_b) / 2, or more. They lie above

    s p, s from down to up,    or    (2 s p - s^2) / per, any s, per = dx or 1 / (heat dx),

and the best s, the slope, gives them. The moves from a point of one cell to one of another are, for
each leg, a square of the two or a triangle of it (cells.py). There p lies above its interpolant
of the corners less

    kappa = sum over both legs of h^2 / 8 (max(p_aa, 0) + max(p_bb, p_aa + 2 p_ab + p_bb, 0)),

the last where a triangle is cut, along its diagonal; or less by the first derivatives (see bulge).
Derivatives are enclosed over both cells, h is a cell's width.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.optim.intervals import Interval, interval
from stickslip.optim.posture.bounds.cells import bulge
from stickslip.optim.posture.criteria import Criterion

if TYPE_CHECKING:
    from jaxtyping import Bool, Float, Int

    from stickslip.optim.posture.bounds.cells import Axis, StationCells

    Array = Float[np.ndarray, "..."]


class Term(NamedTuple):
    """max(down p, up p), or p^2 / per where Y is None."""

    X: str
    Y: str | None
    up: float = 1.0
    down: float = 0.0
    heat: float = 0.0

    def per(self, dx: float) -> float:
        return 1 / (self.heat * dx) if self.heat else dx

    def cost(self, p: Array, dx: float) -> Array:
        return np.maximum(self.up * p, self.down * p) if self.Y is not None else p**2 / self.per(dx)

    def below(self, slope: Array, p: Array, kappa: Array, dx: float) -> tuple[Array, Array]:
        """A bound of what is paid for p within kappa, concave in the slope, and its derivative."""
        if self.Y is not None:
            p = p - kappa
            return slope * p, p
        size, sign = np.abs(slope), np.sign(slope)
        value = (2 * slope * p - 2 * size * kappa - slope**2) / self.per(dx)
        return value, 2 * (p - sign * kappa - slope) / self.per(dx)

    def slopes(self, p: Array) -> tuple[Array, Array]:
        """The least and the largest that may be best; p: [n, corners]."""
        if self.Y is not None:
            return np.full(len(p), self.down), np.full(len(p), self.up)
        return np.min(p, axis=1), np.max(p, axis=1)


PAIRS = {
    "wheel_energy": (("torque", "turn"),),
    "total_energy": (("torque", "turn"), ("leg_rear", "rear"), ("leg_front", "front")),
    "torque_variation": (("torque", None),),
}


def terms_of(criterion: Criterion) -> list[Term]:
    """The terms of a sum over steps; ValueError for a criterion that has no such form here."""
    if criterion.name not in PAIRS:
        known = ", ".join(PAIRS)
        raise ValueError(f"criterion = {criterion.name}; accepted: {known}, and worst stations")
    terms = [Term(X, Y) for X, Y in PAIRS[criterion.name]]
    if criterion.rates is None:
        return terms
    ups, downs = np.asarray(criterion.rates, float).tolist()
    rated = [term._replace(up=u, down=d) for term, u, d in zip(terms, ups, downs, strict=False)]
    heats = zip(("leg_rear", "leg_front"), ups[len(terms) :], strict=False)
    return rated + [Term(leg, None, heat=heat) for leg, heat in heats if heat]


LEGS = {"rear": 0, "front": 1}
FOUR = ((0, 0), (0, 1), (1, 0), (1, 1))
"""A cell's corners: rear and front."""


class Field(NamedTuple):
    """A field over n cells: at their corners, over all of each, and its derivatives there."""

    corners: Float[np.ndarray, "n 4"]
    over: Interval
    first: Interval
    """[2, n], as second."""
    second: Interval
    radius: float
    """Greatest error of a corner."""

    def of(self, cells: np.ndarray) -> Field:
        parts = (self.over[cells], self.first[:, cells], self.second[:, cells])
        return Field(self.corners[cells], *parts, self.radius)


@dataclass(frozen=True)
class Side:
    """The n cells of a waypoint, row by row, in the least rectangle that holds all alive ones."""

    rear: Axis
    front: Axis
    alive: Bool[np.ndarray, "R F"]
    known: Bool[np.ndarray, "n"]
    smooth: Bool[np.ndarray, "n"]
    widths: Float[np.ndarray, "2 n"]
    fields: dict[str, Field]
    box: tuple[slice, slice]
    """Position of the rectangle among all cells."""

    @classmethod
    def of(cls, cells: StationCells, terms: list[Term]) -> Side:
        box, (rear, front) = cells.box, cells.boxed
        alive, widths = cells.alive[box], map(np.diff, (rear, front))
        widths = np.stack(np.meshgrid(*widths, indexing="ij")).reshape(2, -1)
        known, smooth = (of[box].ravel() for of in (cells.inside.known, cells.inside.smooth))
        names = {name for term in terms for name in (term.X, term.Y) if name}
        fields = {name: _field(cells, name, box) for name in names}
        return cls(rear, front, alive, known & alive.ravel(), smooth, widths, fields, box)


def _field(cells: StationCells, name: str, box: tuple[slice, slice]) -> Field:
    """A field of the cells, or a leg's angle itself."""
    leg = LEGS.get(name)
    nodes = np.meshgrid(cells.rear, cells.front, indexing="ij")
    at = cells.values[name] if leg is None else nodes[leg]
    corners = [at[i : i + at.shape[0] - 1, j : j + at.shape[1] - 1][box] for i, j in FOUR]
    values = np.stack(corners, -1).reshape(-1, 4)
    if leg is not None:
        over, one = Interval(*values[:, ::3].T), np.repeat(np.eye(2)[:, leg, None], len(values), 1)
        return Field(values, over, interval(one), interval(0 * one), 0.0)
    counts = (cells.inside.known & cells.alive)[box].ravel()

    def row(of: np.ndarray) -> np.ndarray:
        return np.where(counts, of[(..., *box)].reshape(*of.shape[:-2], -1), 0.0)

    first, second = (cells.inside.derivative(name, order).map(row) for order in (1, 2))
    with np.errstate(invalid="ignore"):
        over = cells.range_of(name).map(row)
    return Field(values, over, first, second, cells.radii[name])


SLACK = 1e-9
"""Relative allowance of each loss for rounding outside of interval arithmetic."""


def kappas(
    term: Term,
    ends: tuple[Side, Side],
    cells: tuple[Int[np.ndarray, "n"], Int[np.ndarray, "n"]],
    cut: Bool[np.ndarray, "2 n"],
) -> Float[np.ndarray, "n"]:
    """Losses of moves from cells of one end to those of the other; cut: a leg's are a triangle."""
    X, U = (side.fields[term.X].of(at) for side, at in zip(ends, cells, strict=True))
    if term.Y is None:
        both = zip((X, U), ends, cells, strict=True)
        each = (_least(of.second.size, of.first.size, side, at) for of, side, at in both)
        total = sum(each, np.zeros(len(cells[0]))) * (1 + SLACK)
        return total / 2 if term.heat else total
    Y, V = (side.fields[term.Y].of(at) for side, at in zip(ends, cells, strict=True))
    change, mean = V.over - Y.over, (X.over + U.over) * 0.5
    before = _high(X.second * change * 0.5 - X.first * Y.first - mean * Y.second)
    after = _high(U.second * change * 0.5 + U.first * V.first + mean * V.second)
    both = (U.first + X.first) * (V.first - Y.first) + mean * (V.second - Y.second)
    along = _high((X.second + U.second) * change * 0.5 + both)
    after = np.where(cut, np.maximum(after, along), after)
    total = np.zeros(len(cells[0]))
    pairs = ((X, Y, before), (U, V, after))
    for (A, B, bend), side, at in zip(pairs, ends, cells, strict=True):
        slope = A.first.size * change.size * 0.5 + mean.size * B.first.size
        total += _least(bend, slope, side, at)
    return total * (1 + SLACK)


def _high(of: Interval) -> np.ndarray:
    return np.maximum(of.hi, 0.0)


def _least(bend: np.ndarray, slope: np.ndarray, side: Side, at: np.ndarray) -> np.ndarray:
    return np.sum(bulge(side.widths[:, at], slope, bend, side.smooth[at]), axis=0)


def sizes(term: Term, ends: tuple[Side, Side]) -> tuple[float, float]:
    """|p| of a step at most, and its rounding error, from the radii of its corners' values."""
    X, U = (side.fields[term.X] for side in ends)
    off, total = X.radius + U.radius, float(np.max(X.over.size) + np.max(U.over.size))
    if term.Y is None:
        return total, 1.01 * off
    Y, V = (side.fields[term.Y] for side in ends)
    ways = (V.over, Y.over), (Y.over, V.over)
    change = float(max(np.max(a.hi) - np.min(b.lo) for a, b in ways))
    by = Y.radius + V.radius
    return total * change / 2, 1.01 * (off * abs(change) / 2 + total / 2 * by + off * by)
