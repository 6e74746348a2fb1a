"""Enclosures of ground that is a spline or a table: of each piece that an interval meets."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.intervals.arithmetic import Interval, hull, interval, where

if TYPE_CHECKING:
    from stickslip.dynamics.ugv.ground.spline import Spline

Four = tuple[Interval, Interval, Interval, Interval]
"""Height, slope and two derivatives more."""
JOINED, BENT = 1e-5, 1e-2
"""Tolerance between a piece's end and the next one's beginning that count as joined: in height
[m] and slope, and in parts of the largest second derivative. Tables in single precision miss by so
much by rounding; a bound is lowered for it by an allowance (branch.py), which is not proved."""


def spline_ground(
    shape: Spline,
) -> tuple[Callable[[Interval], Four], np.ndarray, np.ndarray, np.ndarray, float]:
    """profile, kinks, bends, knots and what joints miss of a Ground; straight past the ends."""
    knots = np.asarray(shape.knots, float) + np.asarray(shape.rests, float)
    rows = np.asarray(shape.coefficients, float)
    lows = np.asarray(shape.lows, float)
    kinks, bends, missed = _jumps(knots, rows, lows)
    last = len(rows) - 1

    def profile(x: Interval) -> Four:
        first = np.searchsorted(knots, x.lo, side="left") - 1
        past = np.searchsorted(knots, x.hi, side="right") - 1
        first, past = np.clip(first, 0, last), np.clip(past, 0, last)
        found = _piece(x, knots, rows, lows, first)
        for more in range(1, int(np.max(past - first, initial=0)) + 1):
            beyond = first + more <= past
            piece = np.minimum(first + more, past)
            other = _piece(x, knots, rows, lows, piece)
            y, dy, d2y, d3y = (
                where(beyond, hull(a, b), a) for a, b in zip(found, other, strict=True)
            )
            found = y, dy, d2y, d3y
        return found

    return profile, kinks, bends, knots, missed


def _piece(
    x: Interval, knots: np.ndarray, rows: np.ndarray, lows: np.ndarray, piece: np.ndarray
) -> Four:
    """Value over the part of x in that piece; straight where x lies outside all of them."""
    begin, end = knots[piece], knots[piece + 1]
    inside = Interval(np.clip(x.lo, begin, end), np.clip(x.hi, begin, end))
    t = inside - begin
    row = rows[piece]
    powers = rows.shape[1]
    zero = interval(np.zeros(x.shape))
    y, dy, d2y, d3y = zero, zero, zero, zero
    for k in range(powers - 1, -1, -1):
        d3y = d3y * t + d2y * 3.0
        d2y = d2y * t + dy * 2.0
        dy = dy * t + y
        y = y * t + row[..., k]
    y = y + lows[piece]
    before = (piece == 0) & (x.lo < begin)
    after = (piece == len(rows) - 1) & (x.hi > end)
    outside = before | after
    if np.any(outside):
        y, dy, d2y, d3y = _straight(x, (y, dy, d2y, d3y), outside, begin, end, (row, lows[piece]))
    return y, dy, d2y, d3y


def _straight(
    x: Interval,
    found: Four,
    outside: np.ndarray,
    begin: np.ndarray,
    end: np.ndarray,
    numbers: tuple[np.ndarray, np.ndarray],
) -> Four:
    """The hull of a piece and of the straight beyond its outer end."""
    row, low = numbers
    y, dy, d2y, d3y = found
    at_end = interval(end) - begin
    edge, slope = interval(np.zeros(x.shape)), interval(np.zeros(x.shape))
    for k in range(row.shape[-1] - 1, -1, -1):
        slope = slope * at_end + edge
        edge = edge * at_end + row[..., k]
    edge = edge + low
    back = Interval(np.minimum(x.lo, begin), np.minimum(x.hi, begin)) - begin
    on = Interval(np.maximum(x.lo, end), np.maximum(x.hi, end)) - end
    behind = x.lo < begin
    ahead = x.hi > end
    first = interval(row[..., 0]) + low + back * row[..., 1]
    beyond = edge + on * slope
    zero = interval(np.zeros(x.shape))
    wholly = (outside & behind & (x.hi <= begin)) | (outside & ahead & (x.lo >= end))

    def joined(within: Interval, before: Interval, after: Interval) -> Interval:
        """The hull of what x meets, or the straight alone."""
        wide = where(outside & behind, where(wholly, before, hull(within, before)), within)
        return where(outside & ahead, where(wholly, after, hull(wide, after)), wide)

    return (
        joined(y, first, beyond),
        joined(dy, interval(row[..., 1]), slope),
        joined(d2y, zero, zero),
        joined(d3y, zero, zero),
    )


def _jumps(
    knots: np.ndarray, rows: np.ndarray, lows: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Knots at which height or slope jump, those at which the second derivative does, and by how
    much height [m] or slope miss at worst at the others."""
    powers = rows.shape[1]
    h = np.diff(knots)
    c = [rows[:, k] if k < powers else np.zeros(len(rows)) for k in range(6)]
    ends = np.sum([c[k] * h**k for k in range(1, 6)], axis=0)
    y = (rows[1:, 0] - rows[:-1, 0]) + (lows[1:] - lows[:-1]) - ends[:-1]
    slope_end = np.sum([k * c[k] * h ** (k - 1) for k in range(1, 6)], axis=0)
    bend_end = np.sum([k * (k - 1) * c[k] * h ** (k - 2) for k in range(2, 6)], axis=0)
    turn = c[1][1:] - slope_end[:-1]
    bend = 2 * c[2][1:] - bend_end[:-1]
    # Past the ends it goes on straight: the bend there jumps to 0.
    inner = knots[1:-1]
    off = np.maximum(np.abs(y), np.abs(turn))
    kinked = off > JOINED
    bent = np.abs(bend) > BENT * (1e-6 + np.max(np.abs(c[2])))
    edges = [(knots[0], 2 * c[2][0]), (knots[-1], bend_end[-1])]
    outer = [at for at, jump in edges if abs(jump) > BENT * np.max(np.abs(c[2]))]
    missed = float(np.max(off[~kinked], initial=0.0))
    return inner[kinked], np.concatenate([inner[bent], outer]), missed
