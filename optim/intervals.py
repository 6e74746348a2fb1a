"""Intervals that hold every value that exact arithmetic could give, and derivatives of it.

Sums, products, quotients and roots are those of IEEE 754, off by half a unit in the last place, and
are widened by a whole one. NumPy's sine, cosine, exponential and arctangent are taken to be off by
at most ULPS units (they claim 4 or fewer), and are widened by that: the one assumption. Division by
an interval that holds 0, and roots of numbers below 0, give [-inf, inf]; so does what has no value,
such as the difference of two infinite ends: an end is NaN only where given so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from jaxtyping import Bool, Float

    Array = Float[np.ndarray, "..."]
    Index: TypeAlias = "int | slice | np.ndarray | tuple"
    Other: TypeAlias = "Interval | Array | float"
    Operand: TypeAlias = "Jet | Interval | float"


ULPS = 8
"""Error of NumPy's elementary functions, in units in the last place."""
EPS = float(np.finfo(float).eps)
TINY = float(np.finfo(float).tiny)
_unbounded = np.errstate(over="ignore", invalid="ignore")
"""Around operations whose infinite results, and lack of any, are meant."""


@dataclass(frozen=True)
class Interval:
    """lo <= x <= hi, entry by entry, any shape. Numbers beside intervals count as exact."""

    lo: Array
    hi: Array

    __array_ufunc__ = None

    @property
    def shape(self) -> tuple[int, ...]:
        return np.shape(self.lo)

    @property
    @_unbounded
    def middle(self) -> Array:
        """A number inside; infinite where an end is, 0 where both are, to both sides."""
        found = self.lo / 2 + self.hi / 2
        return np.where(np.isnan(found) & (self.lo < self.hi), 0.0, found)

    @property
    @_unbounded
    def radius(self) -> Array:
        """No number inside is farther from `middle`."""
        m = self.middle
        return _up(np.maximum(_up(self.hi - m), _up(m - self.lo)))

    @property
    def size(self) -> Array:
        return np.maximum(np.abs(self.lo), np.abs(self.hi))

    @property
    def least_size(self) -> Array:
        return np.maximum(np.maximum(self.lo, -self.hi), 0.0)

    def __getitem__(self, key: Index) -> Interval:
        return Interval(self.lo[key], self.hi[key])

    def holds(self, x: Array | float) -> Bool[np.ndarray, "..."]:
        """Mask of x inside the interval."""
        return (self.lo <= x) & (x <= self.hi)

    def map(self, function: Callable[[Array], Array]) -> Interval:
        return Interval(function(self.lo), function(self.hi))

    def __neg__(self) -> Interval:
        return Interval(-self.hi, -self.lo)

    @_unbounded
    def __add__(self, other: Other) -> Interval:
        o = interval(other)
        return Interval(_down(self.lo + o.lo), _up(self.hi + o.hi))

    __radd__ = __add__

    @_unbounded
    def __sub__(self, other: Other) -> Interval:
        o = interval(other)
        return Interval(_down(self.lo - o.hi), _up(self.hi - o.lo))

    def __rsub__(self, other: Other) -> Interval:
        return interval(other) - self

    @_unbounded
    def __mul__(self, other: Other) -> Interval:
        if isinstance(other, float | int):
            a, b = self.lo * other, self.hi * other
            return Interval(_down(np.minimum(a, b)), _up(np.maximum(a, b)))
        o = interval(other)
        a, b, c, d = self.lo * o.lo, self.lo * o.hi, self.hi * o.lo, self.hi * o.hi
        low = np.minimum(np.minimum(a, b), np.minimum(c, d))
        high = np.maximum(np.maximum(a, b), np.maximum(c, d))
        return Interval(_down(low), _up(high))

    __rmul__ = __mul__

    def __truediv__(self, other: Other) -> Interval:
        return self * interval(other).reciprocal()

    def __rtruediv__(self, other: Other) -> Interval:
        return interval(other) * self.reciprocal()

    @_unbounded
    def reciprocal(self) -> Interval:
        zero = (self.lo <= 0) & (self.hi >= 0)
        lo, hi = np.where(zero, 1.0, self.lo), np.where(zero, 1.0, self.hi)
        found = _down(1 / hi), _up(1 / lo)
        return Interval(np.where(zero, -np.inf, found[0]), np.where(zero, np.inf, found[1]))

    @_unbounded
    def square(self) -> Interval:
        """x^2, never below 0."""
        low, high = self.least_size, self.size
        return Interval(np.maximum(_down(low * low), 0.0), _up(high * high))

    def sqrt(self) -> Interval:
        """The root; of what may be negative nothing is known."""
        bad = self.lo < 0
        low = np.maximum(_down(np.sqrt(np.where(bad, 1.0, self.lo))), 0.0)
        high = _up(np.sqrt(np.maximum(self.hi, 0.0)))
        return Interval(np.where(bad, -np.inf, low), np.where(bad, np.inf, high))

    @_unbounded
    def exp(self) -> Interval:
        low, high = (_off(np.exp(v)) for v in (self.lo, self.hi))
        return Interval(np.maximum(low.lo, 0.0), high.hi)

    def arctan(self) -> Interval:
        return Interval(_off(np.arctan(self.lo)).lo, _off(np.arctan(self.hi)).hi)

    def cos(self) -> Interval:
        return self._wave(np.cos, 0.0)

    def sin(self) -> Interval:
        return self._wave(np.sin, 0.25)

    @_unbounded
    def _wave(self, function: np.ufunc, turn: float) -> Interval:
        """Sine or cosine, whose tops are at 2 pi (n + turn): turning points are looked for in
        whole turns, with room for their rounding."""
        low, high = (_off(function(v)) for v in (self.lo, self.hi))
        top, bottom = _passes(self, turn), _passes(self, turn + 0.5)
        return Interval(
            np.where(bottom, -1.0, np.maximum(np.minimum(low.lo, high.lo), -1.0)),
            np.where(top, 1.0, np.minimum(np.maximum(low.hi, high.hi), 1.0)),
        )

    def clip(self, low: Array | float, high: Array | float) -> Interval:
        return Interval(np.clip(self.lo, low, high), np.clip(self.hi, low, high))


def interval(value: Other) -> Interval:
    """The interval of one number, or the interval itself."""
    if isinstance(value, Interval):
        return value
    array = np.asarray(value, float)
    return Interval(array, array)


def hull(a: Interval, b: Interval) -> Interval:
    """The least interval that holds both."""
    return Interval(np.minimum(a.lo, b.lo), np.maximum(a.hi, b.hi))


def where(condition: np.ndarray, a: Interval | float, b: Interval | float) -> Interval:
    """np.where of both ends."""
    a, b = interval(a), interval(b)
    return Interval(np.where(condition, a.lo, b.lo), np.where(condition, a.hi, b.hi))


def _passes(x: Interval, turn: float) -> Bool[np.ndarray, "..."]:
    """True if 2 pi (n + turn) may lie inside for a whole n."""
    slack = 4 * EPS
    low = x.lo / (2 * np.pi) - turn
    high = x.hi / (2 * np.pi) - turn
    low, high = low - slack * (1 + np.abs(low)), high + slack * (1 + np.abs(high))
    return np.floor(high) >= np.ceil(low)


def _off(value: Array) -> Interval:
    """Interval around an elementary function's rounded result."""
    by = ULPS * EPS * np.abs(value) + TINY
    return Interval(np.fmax(value - by, -np.inf), np.fmin(value + by, np.inf))


def _down(value: Array) -> Array:
    """The next number below; -inf for what is none."""
    return np.nextafter(np.fmax(value, -np.inf), -np.inf)


def _up(value: Array) -> Array:
    """The next number above; inf for what is none."""
    return np.nextafter(np.fmin(value, np.inf), np.inf)


@dataclass(frozen=True)
class Jet:
    """A function over a box, and its derivatives along each axis there.

    value: [...]. first, second: [axes, ...], of each axis alone; no mixed ones. Operations as those
    of Interval; what is no Jet beside one is constant, and stands behind it in - and /.
    """

    value: Interval
    first: Interval
    second: Interval

    __array_ufunc__ = None

    def __neg__(self) -> Jet:
        return Jet(-self.value, -self.first, -self.second)

    def __add__(self, other: Operand) -> Jet:
        if isinstance(other, Jet):
            sums = (self.value + other.value, self.first + other.first, self.second + other.second)
            return Jet(*sums)
        return Jet(self.value + other, self.first, self.second)

    __radd__ = __add__

    def __sub__(self, other: Operand) -> Jet:
        return self + (-other if isinstance(other, Jet) else -interval(other))

    def __mul__(self, other: Operand) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value * other, self.first * other, self.second * other)
        return Jet(
            self.value * other.value,
            self.first * other.value + other.first * self.value,
            self.second * other.value + self.first * other.first * 2.0 + other.second * self.value,
        )

    __rmul__ = __mul__

    def __truediv__(self, other: Operand) -> Jet:
        if isinstance(other, Jet):
            return self * other.reciprocal()
        return self * interval(other).reciprocal()

    def through(self, value: Interval, slope: Interval, bend: Interval) -> Jet:
        """A function of this one, of which value, slope and second derivative are known."""
        return Jet(value, self.first * slope, self.first.square() * bend + self.second * slope)

    def square(self) -> Jet:
        return self.through(self.value.square(), self.value * 2.0, interval(2.0))

    def reciprocal(self) -> Jet:
        inverse = self.value.reciprocal()
        square = inverse.square()
        return self.through(inverse, -square, square * inverse * 2.0)

    def sqrt(self) -> Jet:
        root = self.value.sqrt()
        slope = (root * 2.0).reciprocal()
        return self.through(root, slope, -(slope / (self.value * 2.0)))

    def arctan(self) -> Jet:
        slope = (self.value.square() + 1.0).reciprocal()
        return self.through(self.value.arctan(), slope, -(self.value * slope.square() * 2.0))

    def sin(self) -> Jet:
        sine, cosine = self.value.sin(), self.value.cos()
        return self.through(sine, cosine, -sine)

    def cos(self) -> Jet:
        sine, cosine = self.value.sin(), self.value.cos()
        return self.through(cosine, -sine, -cosine)
