"""Greatest distance of a step's p below its interpolant of the corners of two cells.

The moves from a point of one cell to one of another are, for each leg, a square of the two or a
triangle of it (lattice.py). There p lies above its interpolant of the corners less

    kappa = sum over both legs of h^2 / 8 (max(p_aa, 0) + max(p_bb, p_aa + 2 p_ab + p_bb, 0)),

the last where a triangle is cut, along its diagonal; or h / 2 of the first derivatives, whichever
is less. Derivatives are enclosed over both cells, h is a cell's width.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from jaxtyping import Bool, Float, Int

    from stickslip.optim.intervals.arithmetic import Interval
    from stickslip.optim.posture.bounds.sides import Side
    from stickslip.optim.posture.bounds.terms import Term

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
        return (_alone(X.first, X.second, ends[0], cells[0])
                + _alone(U.first, U.second, ends[1], cells[1])) * (1 + SLACK)  # fmt: skip
    Y, V = (side.fields[term.Y].of(at) for side, at in zip(ends, cells, strict=True))
    way, mean = V.over - Y.over, (X.over + U.over) * 0.5
    before = _high(X.second * way * 0.5 - X.first * Y.first - mean * Y.second)
    after = _high(U.second * way * 0.5 + U.first * V.first + mean * V.second)
    both = (U.first + X.first) * (V.first - Y.first) + mean * (V.second - Y.second)
    along = _high((X.second + U.second) * way * 0.5 + both)
    after = np.where(cut, np.maximum(after, along), after)
    total = np.zeros(len(cells[0]))
    for (A, B), bend, side, at in (((X, Y), before, *_end(ends, cells, 0)),
                                   ((U, V), after, *_end(ends, cells, 1))):  # fmt: skip
        slope = A.first.size * way.size * 0.5 + mean.size * B.first.size
        total += _least(bend, slope, side, at)
    return total * (1 + SLACK)


def _end(
    ends: tuple[Side, Side], cells: tuple[np.ndarray, np.ndarray], number: int
) -> tuple[Side, np.ndarray]:
    return ends[number], cells[number]


def _high(of: Interval) -> np.ndarray:
    return np.maximum(of.hi, 0.0)


def _alone(first: Interval, second: Interval, side: Side, at: np.ndarray) -> np.ndarray:
    """Loss of a field at one end, either way."""
    return _least(second.size, first.size, side, at)


def _least(bend: np.ndarray, slope: np.ndarray, side: Side, at: np.ndarray) -> np.ndarray:
    h = side.widths[:, at]
    curved, straight = h**2 / 8 * bend, h / 2 * slope
    return np.sum(np.where(side.smooth[at], np.minimum(curved, straight), straight), axis=0)


def roundings(term: Term, ends: tuple[Side, Side]) -> float:
    """Rounding error of a step's p, from the radii of its corners' values."""
    X, U = (side.fields[term.X] for side in ends)
    off = X.radius + U.radius
    if term.Y is None:
        return 1.01 * off
    Y, V = (side.fields[term.Y] for side in ends)
    mean = float(np.max(X.over.size) + np.max(U.over.size)) / 2
    way = float(max(np.max(V.over.hi) - np.min(Y.over.lo), np.max(Y.over.hi) - np.min(V.over.lo)))
    by = Y.radius + V.radius
    return 1.01 * (off * abs(way) / 2 + mean * by + off * by)
