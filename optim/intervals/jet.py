"""Intervals with first and second derivatives in each of several directions, by themselves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from stickslip.optim.intervals.arithmetic import Interval, interval

if TYPE_CHECKING:
    Other: TypeAlias = "Jet | Interval | float"


@dataclass(frozen=True)
class Jet:
    """A function over a box, and its derivatives along each axis there.

    value: [...]. first, second: [axes, ...], of each axis alone; no mixed ones. Operations as those
    of Interval; what is no Jet beside one is constant.
    """

    value: Interval
    first: Interval
    second: Interval

    __array_priority__ = 1000
    __array_ufunc__ = None

    def __neg__(self) -> Jet:
        return Jet(-self.value, -self.first, -self.second)

    def __add__(self, other: Other) -> Jet:
        if isinstance(other, Jet):
            sums = (self.value + other.value, self.first + other.first, self.second + other.second)
            return Jet(*sums)
        return Jet(self.value + other, self.first, self.second)

    __radd__ = __add__

    def __sub__(self, other: Other) -> Jet:
        return self + (-other if isinstance(other, Jet) else -interval(other))

    def __rsub__(self, other: Other) -> Jet:
        return -self + other

    def __mul__(self, other: Other) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value * other, self.first * other, self.second * other)
        return Jet(
            self.value * other.value,
            self.first * other.value + other.first * self.value,
            self.second * other.value + self.first * other.first * 2.0 + other.second * self.value,
        )

    __rmul__ = __mul__

    def __truediv__(self, other: Other) -> Jet:
        if isinstance(other, Jet):
            return self * other.reciprocal()
        return self * interval(other).reciprocal()

    def __rtruediv__(self, other: Other) -> Jet:
        return self.reciprocal() * other

    def through(self, value: Interval, slope: Interval, bend: Interval) -> Jet:
        """A function of this one, of which value, slope and second derivative are known."""
        second = self.first.square() * bend + self.second * slope
        return Jet(value, self.first * slope, second)

    def square(self) -> Jet:
        """x^2."""
        two = interval(2.0)
        return self.through(self.value.square(), self.value * 2.0, two)

    def reciprocal(self) -> Jet:
        """1 / x."""
        inverse = self.value.reciprocal()
        square = inverse.square()
        return self.through(inverse, -square, square * inverse * 2.0)

    def sqrt(self) -> Jet:
        """The root."""
        root = self.value.sqrt()
        slope = (root * 2.0).reciprocal()
        return self.through(root, slope, -(slope / (self.value * 2.0)))

    def arctan(self) -> Jet:
        """The angle."""
        slope = (self.value.square() + 1.0).reciprocal()
        return self.through(self.value.arctan(), slope, -(self.value * slope.square() * 2.0))

    def sin(self) -> Jet:
        """The sine."""
        sine, cosine = self.value.sin(), self.value.cos()
        return self.through(sine, cosine, -sine)

    def cos(self) -> Jet:
        """The cosine."""
        sine, cosine = self.value.sin(), self.value.cos()
        return self.through(cosine, -sine, -cosine)
