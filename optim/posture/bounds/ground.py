"""Enclosures of the ground: height, slope and two derivatives more over intervals of x.

From the same numbers as the shapes of `stickslip.dynamics.ugv`, in interval arithmetic.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import singledispatch
from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics.ugv.ground.roughness import Waves
from stickslip.dynamics.ugv.ground.shapes import Bump, Ditch, Flat, Incline, Ramp, Sinusoid, Step
from stickslip.optim.intervals.arithmetic import Interval, hull, interval, where
from stickslip.optim.posture.bounds.spline_ground import spline_ground

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.dynamics.numeric import Numbers

from stickslip.dynamics.ugv.ground.spline import Spline

Derivatives = tuple[Interval, Interval, Interval, Interval]
"""Height [m], slope, second [1/m] and third derivative [1/m^2]."""
NOWHERE = np.zeros(0)
ACCEPTED = (
    "the named tracks, splines, tables and sums of waves; of a function in Python no "
    "enclosure is known: make a table of it (Track.resampled)"
)


@dataclass(frozen=True)
class Ground:
    """A profile over intervals. profile(x): see Derivatives; what jumps is hulled.

    kinks: where height or slope jump [m]; bends: where the second derivative does, so that the
    third is none there.
    """

    profile: Callable[[Interval], Derivatives]
    kinks: Float[np.ndarray, "n"]
    bends: Float[np.ndarray, "m"]
    knots: Float[np.ndarray, "k"] = None  # type: ignore[assignment]
    """Places at which an integral is best divided."""
    missed: float = 0.0
    """Gap between pieces that count as joined, in height [m] or slope."""

    def __post_init__(self):
        if self.knots is None:
            object.__setattr__(self, "knots", NOWHERE)


@singledispatch
def ground_of(shape: object) -> Ground:
    """The ground of a track's shape; ValueError for one of which no enclosure is known."""
    raise ValueError(f"the ground is a {type(shape).__name__}; accepted: {ACCEPTED}")


def _smooth(profile: Callable[[Interval], Derivatives], knots: Sequence[float] = ()) -> Ground:
    return Ground(profile, NOWHERE, NOWHERE, np.asarray(knots, float))


def _float(value: Numbers) -> float:
    return float(np.asarray(value))


@ground_of.register
def _(shape: Flat) -> Ground:
    def profile(x: Interval) -> Derivatives:
        zero = interval(np.zeros(x.shape))
        return zero, zero, zero, zero

    return _smooth(profile)


@ground_of.register
def _(shape: Incline) -> Ground:
    slope = _float(shape.slope)

    def profile(x: Interval) -> Derivatives:
        zero = interval(np.zeros(x.shape))
        return x * slope, zero + slope, zero, zero

    return _smooth(profile)


@ground_of.register
def _(shape: Bump) -> Ground:
    height, centre, width = (_float(v) for v in (shape.height, shape.centre, shape.width))
    per_width = interval(1.0) / width

    def profile(x: Interval) -> Derivatives:
        z = (x - centre) * per_width
        square = z.square()
        y = (-square).exp() * height
        slope = z * y * (per_width * -2.0)
        second = (square * 4.0 - 2.0) * y * per_width.square()
        third = z * (interval(12.0) - square * 8.0) * y * (per_width.square() * per_width)
        return y, slope, second, third

    return _smooth(profile)


@ground_of.register
def _(shape: Sinusoid) -> Ground:
    amplitude, wavelength = _float(shape.amplitude), _float(shape.wavelength)
    k = TWO_PI / wavelength

    def profile(x: Interval) -> Derivatives:
        angle = x * k
        sine, cosine = angle.sin() * amplitude, angle.cos() * amplitude
        square = k.square()
        return sine, cosine * k, -(sine * square), -(cosine * (square * k))

    return _smooth(profile)


@ground_of.register
def _(shape: Waves) -> Ground:
    waves = [
        (float(a), TWO_PI * float(n), float(phase))
        for a, n, phase in zip(
            *(np.asarray(v, float) for v in (shape.amplitudes, shape.frequencies, shape.phases)),
            strict=True,
        )
    ]

    def profile(x: Interval) -> Derivatives:
        y = slope = second = third = interval(np.zeros(x.shape))
        for amplitude, k, phase in waves:
            angle = x * k + phase
            sine, cosine = angle.sin() * amplitude, angle.cos() * amplitude
            square = k.square()
            y, slope = y + cosine, slope - sine * k
            second, third = second - cosine * square, third + sine * (square * k)
        return y, slope, second, third

    return _smooth(profile)


@ground_of.register
def _(shape: Ramp) -> Ground:
    slope, begin, length, joint = (
        _float(v) for v in (shape.slope, shape.position, shape.length, shape.joint)
    )

    def profile(x: Interval) -> Derivatives:
        up, down = _bend(x - begin, joint), _bend((x - begin) - length, joint)
        y, dy, d2y, d3y = ((a - b) * slope for a, b in zip(up, down, strict=True))
        return y, dy, d2y, d3y

    knots = [begin + k * length + s * joint / 2 for k in (0, 1) for s in (-1, 1)]
    return _smooth(profile, knots)


@ground_of.register
def _(shape: Step) -> Ground:
    height, at, length = (_float(v) for v in (shape.height, shape.position, shape.length))

    def profile(x: Interval) -> Derivatives:
        y, dy, d2y, d3y = (of * height for of in _quintic_rise(x - at, length))
        return y, dy, d2y, d3y

    return _smooth(profile, [at - length / 2, at + length / 2])


@ground_of.register
def _(shape: Ditch) -> Ground:
    depth, middle, width, side = (
        _float(v) for v in (shape.depth, shape.position, shape.width, shape.side)
    )

    def profile(x: Interval) -> Derivatives:
        z = x - middle
        first, second = (_quintic_rise(z + k * width, side) for k in (0.5, -0.5))
        y, dy, d2y, d3y = ((b - a) * depth for a, b in zip(first, second, strict=True))
        return y, dy, d2y, d3y

    return _smooth(
        profile, [middle + k * width / 2 + s * side / 2 for k in (-1, 1) for s in (-1, 1)]
    )


@ground_of.register
def _(shape: Spline) -> Ground:
    return Ground(*spline_ground(shape))


TWO_PI = Interval(np.asarray(6.283185307179586), np.asarray(6.283185307179587))


def _inside(u: Interval, value: Interval) -> Interval:
    """The value where 0 <= u <= 1, 0 outside; their hull where u may be either."""
    out, within = (u.lo <= 0) | (u.hi >= 1), (u.hi >= 0) & (u.lo <= 1)
    zero = interval(np.zeros(u.shape))
    return where(~within, zero, where(out, hull(value, zero), value))


def _bend(z: Interval, joint: float) -> Derivatives:
    """As in shapes.py, with the third derivative."""
    free = z / joint + 0.5
    u = free.clip(0.0, 1.0)
    past = z - interval(joint) * 0.5
    past = Interval(np.maximum(past.lo, 0.0), np.maximum(past.hi, 0.0))
    cube = u.square() * u
    value = cube * (interval(1.0) - u * 0.5) * joint + past
    slope = u.square() * (interval(3.0) - u * 2.0)
    second = u * (interval(1.0) - u) * 6.0 / joint
    third = _inside(free, (interval(1.0) - u * 2.0) * 6.0 / joint / joint)
    return value, slope, second, third


def _quintic_rise(z: Interval, length: float) -> Derivatives:
    """As in shapes.py, with the third derivative."""
    free = z / length + 0.5
    u = free.clip(0.0, 1.0)
    one = interval(1.0)
    v = one - u
    value = u.square() * u * (interval(10.0) - u * (interval(15.0) - u * 6.0))
    slope = (u * v).square() * 30.0 / length
    second = u * v * (one - u * 2.0) * 60.0 / length / length
    bent = (one - u * 6.0 + u.square() * 6.0) * 60.0
    return value, slope, second, _inside(free, bent / length / length / length)
