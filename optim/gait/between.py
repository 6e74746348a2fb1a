"""Between a gait's nodes: b as the parabola it is, and all else by the polynomial through samples.

In a cell of length h the acceleration is a + c x, b = b0 + 2 a x + c x^2, and it is passed in

    2 h / (rate + next rate) f(z),   z = sqrt|c| h / (rate + next rate)

with f(z) = artanh(z) / z where c > 0, arctan(z) / z where c < 0; z < 1 there unless b falls to 0.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial.chebyshev import chebval, chebvander
from scipy.integrate import quad_vec

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Float

    from stickslip.optim.gait.profile import Grid

STRAIGHT = 1e-4
"""z below which f(z) is two terms of its series."""
ACCURATE, LEAST_SQUARE = 1e-11, 1e-300
"""Relative error of integrals over time; the least b that is divided by."""
LOOKS, CLOSER_LOOKS = 33, 17
"""Places of a cell where a largest value is looked for, and around the best of them."""
PIECES = 64
"""Pieces of a cell for integrals over the crank angle of functions with kinks (Simpson's rule)."""


def lowest(grid: Grid, a: Float[np.ndarray, "n K+1"], b: Float[np.ndarray, "n K+1"]) -> np.ndarray:
    """The least b of each cell, in closed form [n, K]; 0 in one that begins or ends at rest, but
    for one in which the crank would turn back."""
    b = _rested(grid, b)
    start, slope = b[:, :-1], a[:, :-1]
    c = np.diff(a, axis=1) / grid.h
    bowl = (slope < 0) & (a[:, 1:] > 0)
    dip = start - slope**2 / np.where(bowl, c, 1.0)
    return np.where(bowl, dip, np.minimum(start, b[:, 1:]))


def times(grid: Grid, a: Float[np.ndarray, "n K+1"], b: Float[np.ndarray, "n K+1"]) -> np.ndarray:
    """The time in each cell [n, K] s; infinite where the crank stands still in it."""
    rate = np.sqrt(np.maximum(_rested(grid, b), 0.0))
    passed = _passed(grid.h, rate[:, :-1] + rate[:, 1:], np.diff(a, axis=1) / grid.h)
    return np.where(lowest(grid, a, b) < 0, np.inf, passed)


def over_time(
    grid: Grid, a: np.ndarray, b: np.ndarray, square: Callable[[np.ndarray], np.ndarray]
) -> float:
    """The integral over time of `square` at shares [n, K, 1] of the cells.

    By adaptive quadrature in s, share = s^2 (3 - 2 s): smooth at the ends of a cell that rests at
    one of them, and refined where the crank is slow between them.
    """
    if not np.all(np.isfinite(times(grid, a, b))):
        return np.inf
    b, c = _rested(grid, b), np.diff(a, axis=1) / grid.h

    def rates(s: float) -> np.ndarray:
        share, left = s * s * (3 - 2 * s), (1 - s) ** 2 * (1 + 2 * s)
        x, y = share * grid.h, left * grid.h
        from_start = b[:, :-1] + x * (2 * a[:, :-1] + c * x)
        from_end = b[:, 1:] + y * (c * y - 2 * a[:, 1:])
        rate = np.sqrt(np.maximum(from_start if s < 0.5 else from_end, LEAST_SQUARE))
        return square(np.array([share]))[..., 0] * grid.h * 6 * s * (1 - s) / rate

    return float(np.sum(quad_vec(rates, 0.0, 1.0, epsabs=0.0, epsrel=ACCURATE, norm="max")[0]))


class Polynomials:
    """Through values at `grid.samples` [..., n, K, D+1], one in each cell."""

    def __init__(self, values: np.ndarray):
        degree = values.shape[-1] - 1
        places = np.cos(np.pi * np.arange(degree, -1, -1) / degree)
        found = values @ np.linalg.inv(chebvander(places, degree)).T
        self._coefficients = np.moveaxis(found, -1, 0)[..., None]

    def __call__(self, share: Float[np.ndarray, "... Q"]) -> np.ndarray:
        return chebval(2 * share - 1, self._coefficients, tensor=False)


def peak(function: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """The largest value of `function` in each cell at shares [Q] or [..., Q].

    The best of LOOKS places, then of CLOSER_LOOKS around it, then the vertex of the parabola
    through three.
    """
    share, spread = np.linspace(0.0, 1.0, LOOKS), 1 / (LOOKS - 1)
    values = function(share)
    best = np.argmax(values, axis=-1)[..., None]
    centre = np.clip(share[best], spread, 1 - spread)
    first = np.max(values, axis=-1)
    values = function(centre + spread * np.linspace(-1.0, 1.0, CLOSER_LOOKS))
    best = np.argmax(values, axis=-1)[..., None]
    inner = np.clip(best, 1, CLOSER_LOOKS - 2)
    before, at, after = (np.take_along_axis(values, inner + i, -1)[..., 0] for i in (-1, 0, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        bend, tilt = 2 * at - before - after, (after - before) / 2
        top = at + tilt**2 / (2 * bend)
        within = (bend > 0) & (np.abs(tilt) <= bend) & np.isfinite(top)
    found = np.maximum(first, np.max(values, axis=-1))
    return np.maximum(found, np.where(within, top, -np.inf))


def positive(torque: Polynomials, h: Float[np.ndarray, "n K"]) -> float:
    """The integral over the crank angle of max(T, 0)."""
    values = torque(np.linspace(0.0, 1.0, 2 * PIECES + 1))
    left, middle, right = values[..., :-1:2], values[..., 1::2], values[..., 2::2]
    weight = h[..., None] / PIECES
    simpson = (left + 4 * middle + right) / 6
    found = np.where((left >= 0) & (right >= 0), simpson, 0.0)
    crosses = left * right < 0
    height = np.maximum(left, right)
    part = height**2 / (2 * np.where(crosses, np.abs(left - right), 1.0))
    return float(np.sum(np.where(crosses, part, found) * weight))


def _rested(grid: Grid, b: np.ndarray) -> np.ndarray:
    """b without rounding errors at rest."""
    if not (grid.from_rest or grid.to_rest):
        return b
    b = b.copy()
    if grid.from_rest:
        b[0, 0] = 0.0
    if grid.to_rest:
        b[-1, -1] = 0.0
    return b


def _passed(length: np.ndarray, rates: np.ndarray, c: np.ndarray) -> np.ndarray:
    """The time over a length, the sum of the rates at its ends being `rates`."""
    with np.errstate(divide="ignore", invalid="ignore"):
        z = np.sqrt(np.abs(c)) * length / rates
        small = z < STRAIGHT
        safe = np.where(small, 0.5, z)
        bowl = np.arctanh(np.where(c > 0, np.minimum(safe, 1.0), 0.0)) / safe
        factor = np.where(c > 0, bowl, np.arctan(safe) / safe)
        factor = np.where(small, 1 + np.sign(c) * z**2 / 3, factor)
        return np.where(rates > 0, 2 * length / rates * factor, np.inf)
