"""Enclosures of the ground over intervals of x: height, three derivatives and arc length.

From the same numbers as the shapes of `stickslip.dynamics.ugv`, in interval arithmetic.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from stickslip.dynamics.checks import require_memory
from stickslip.dynamics.ugv.ground.roughness import Waves
from stickslip.dynamics.ugv.ground.shapes import Bump, Ditch, Flat, Incline, Ramp, Sinusoid, Step
from stickslip.dynamics.ugv.ground.spline import Spline
from stickslip.optim.intervals import Interval, hull, interval, where

if TYPE_CHECKING:
    from jaxtyping import Float


Derivatives = tuple[Interval, ...]
"""Height [m], slope, second [1/m] and third derivative [1/m^2]."""
NOWHERE = np.zeros(0)
ACCEPTED = (
    "the named tracks, splines, tables and sums of waves; of a function in Python no "
    "enclosure is known: make a table of it (Track.resampled)"
)


@dataclass(frozen=True)
class Ground:
    """A profile over intervals. profile(x): see Derivatives; what jumps is hulled.

    kinks: where height or slope jump [m]; bends: where the second derivative does.
    """

    profile: Callable[[Interval], Derivatives]
    kinks: Float[np.ndarray, "n"]
    bends: Float[np.ndarray, "m"]
    knots: Float[np.ndarray, "k"]
    """Places at which an integral is best divided."""
    missed: float = 0.0
    """Gap between pieces that count as joined, in height [m] or slope."""


def ground_of(shape: object) -> Ground:
    """The ground of a track's shape; ValueError for one of which no enclosure is known."""
    if isinstance(shape, Spline):
        return _of_spline(shape)
    if type(shape) not in PROFILES:
        raise ValueError(f"the ground is a {type(shape).__name__}; accepted: {ACCEPTED}")
    profile, joints = PROFILES[type(shape)]
    numbers = [np.asarray(of, float) for of in vars(shape).values()]
    numbers = [of if of.ndim else float(of) for of in numbers]
    knots = np.array([] if joints is None else joints(*numbers), float)
    return Ground(lambda x: profile(x, *numbers), NOWHERE, NOWHERE, knots)


def _flat(x: Interval) -> Derivatives:
    zero = interval(np.zeros(x.shape))
    return zero, zero, zero, zero


def _incline(x: Interval, slope: float) -> Derivatives:
    zero = interval(np.zeros(x.shape))
    return x * slope, zero + slope, zero, zero


def _bump(x: Interval, height: float, centre: float, width: float) -> Derivatives:
    per_width = interval(1.0) / width
    z = (x - centre) * per_width
    square = z.square()
    y = (-square).exp() * height
    slope = z * y * (per_width * -2.0)
    second = (square * 4.0 - 2.0) * y * per_width.square()
    third = z * (interval(12.0) - square * 8.0) * y * (per_width.square() * per_width)
    return y, slope, second, third


def _sinusoid(x: Interval, amplitude: float, wavelength: float) -> Derivatives:
    k = TWO_PI / wavelength
    angle, square = x * k, k.square()
    sine, cosine = angle.sin() * amplitude, angle.cos() * amplitude
    return sine, cosine * k, -(sine * square), -(cosine * (square * k))


def _waves(x: Interval, *waves: Float[np.ndarray, "waves"]) -> Derivatives:
    """Amplitudes, frequencies and phases."""
    y = slope = second = third = interval(np.zeros(x.shape))
    for amplitude, frequency, phase in zip(*(of.tolist() for of in waves), strict=True):
        k = TWO_PI * frequency
        angle, square = x * k + phase, k.square()
        sine, cosine = angle.sin() * amplitude, angle.cos() * amplitude
        y, slope = y + cosine, slope - sine * k
        second, third = second - cosine * square, third + sine * (square * k)
    return y, slope, second, third


def _ramp(x: Interval, slope: float, begin: float, length: float, joint: float) -> Derivatives:
    up, down = _bend(x - begin, joint), _bend((x - begin) - length, joint)
    return tuple((a - b) * slope for a, b in zip(up, down, strict=True))


def _step(x: Interval, height: float, at: float, length: float) -> Derivatives:
    return tuple(of * height for of in _quintic_rise(x - at, length))


def _ditch(x: Interval, depth: float, middle: float, width: float, side: float) -> Derivatives:
    first, second = (_quintic_rise(x - middle + k * width, side) for k in (0.5, -0.5))
    return tuple((b - a) * depth for a, b in zip(first, second, strict=True))


def _about(middles: Sequence[float], length: float) -> list[float]:
    """Both ends of joints of a length."""
    return [middle + sign * length / 2 for middle in middles for sign in (-1, 1)]


PROFILES: dict[type, tuple[Callable[..., Derivatives], Callable[..., list[float]] | None]] = {
    Flat: (_flat, None),
    Incline: (_incline, None),
    Bump: (_bump, None),
    Sinusoid: (_sinusoid, None),
    Waves: (_waves, None),
    Ramp: (_ramp, lambda _, at, length, joint: _about((at, at + length), joint)),
    Step: (_step, lambda _, at, length: _about((at,), length)),
    Ditch: (_ditch, lambda _, at, width, side: _about((at - width / 2, at + width / 2), side)),
}
"""Profiles of x and a shape's numbers, and the ends of its joints by these numbers."""

TWO_PI = Interval(np.asarray(6.283185307179586), np.asarray(6.283185307179587))


def _inside(u: Interval, value: Interval) -> Interval:
    """The value where 0 <= u <= 1, 0 outside; their hull where u may be either."""
    out, within = (u.lo <= 0) | (u.hi >= 1), (u.hi >= 0) & (u.lo <= 1)
    zero = interval(np.zeros(u.shape))
    return where(~within, zero, where(out, hull(value, zero), value))


def _bend(z: Interval, joint: float) -> Derivatives:
    """The function of shapes.py, with its third derivative."""
    free = z / joint + 0.5
    u = free.clip(0.0, 1.0)
    past = (z - interval(joint) * 0.5).clip(0.0, np.inf)
    value = u.square() * u * (interval(1.0) - u * 0.5) * joint + past
    slope = u.square() * (interval(3.0) - u * 2.0)
    second = u * (interval(1.0) - u) * 6.0 / joint
    third = _inside(free, (interval(1.0) - u * 2.0) * 6.0 / joint / joint)
    return value, slope, second, third


def _quintic_rise(z: Interval, length: float) -> Derivatives:
    """The function of shapes.py, with its third derivative."""
    free = z / length + 0.5
    u = free.clip(0.0, 1.0)
    one = interval(1.0)
    v = one - u
    value = u.square() * u * (interval(10.0) - u * (interval(15.0) - u * 6.0))
    slope = (u * v).square() * 30.0 / length
    second = u * v * (one - u * 2.0) * 60.0 / length / length
    bent = (one - u * 6.0 + u.square() * 6.0) * 60.0
    return value, slope, second, _inside(free, bent / length / length / length)


JOINED, BENT = 1e-5, 1e-2
"""Tolerance between a piece's end and the next one's beginning that count as joined: in height
[m] and slope, and in parts of the largest second derivative. Tables in single precision miss by so
much by rounding; a bound is lowered for it by an allowance (branch.py), which is not proved."""


def _of_spline(shape: Spline) -> Ground:
    """Pieces within knots, and the straights beyond the ends as pieces of their own."""
    knots = np.asarray(shape.knots, float) + np.asarray(shape.rests, float)
    rows = np.asarray(shape.coefficients, float)
    lows = np.asarray(shape.lows, float)
    kinks, bends, missed = _jumps(knots, rows, lows)
    edges = np.concatenate([[-np.inf], knots, [np.inf]])
    origins = np.concatenate([knots[:1], knots])
    powers = [_with_straights(k, knots, rows, lows) for k in range(rows.shape[1])]
    last = len(edges) - 2

    def piece(x: Interval, at: np.ndarray) -> Derivatives:
        """Value over the part of x in that piece."""
        t = x.clip(edges[at], edges[at + 1]) - origins[at]
        y = dy = d2y = d3y = interval(np.zeros(x.shape))
        for power in powers[::-1]:
            d3y = d3y * t + d2y * 3.0
            d2y = d2y * t + dy * 2.0
            dy = dy * t + y
            y = y * t + power[at]
        return y, dy, d2y, d3y

    def profile(x: Interval) -> Derivatives:
        first = np.clip(np.searchsorted(edges, x.lo, side="left") - 1, 0, last)
        past = np.clip(np.searchsorted(edges, x.hi, side="right") - 1, 0, last)
        found = piece(x, first)
        for more in range(1, int(np.max(past - first, initial=0)) + 1):
            beyond = first + more <= past
            other = piece(x, np.minimum(first + more, past))
            found = tuple(where(beyond, hull(a, b), a) for a, b in zip(found, other, strict=True))
        return found

    return Ground(profile, kinks, bends, knots, missed)


def _with_straights(k: int, knots: np.ndarray, rows: np.ndarray, lows: np.ndarray) -> Interval:
    """Coefficients of a power, those of the straights before and after the knots included."""
    if k > 1:
        return interval(np.pad(rows[:, k], 1))
    here, length, end = interval(rows[:, k]), interval(knots[-1]) - knots[-2], interval(0.0)
    for power in range(rows.shape[1] - 1, k - 1, -1):
        end = end * length + interval(rows[-1, power]) * float(power if k else 1)
    if k == 0:
        here, end = here + lows, end + lows[-1]
    return Interval(*(np.concatenate([of[:1], of, [at]])
                      for of, at in ((here.lo, end.lo), (here.hi, end.hi))))  # fmt: skip


def _jumps(
    knots: np.ndarray, rows: np.ndarray, lows: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Knots at which height or slope jump, those at which the second derivative does, and by how
    much height [m] or slope miss at worst at the others."""
    c = np.pad(rows, [(0, 0), (0, max(3 - rows.shape[1], 0))]).T
    rise = np.concatenate([np.zeros_like(c[:1]), c[1:]])  # from the height at the left knot
    ends, slope_end, bend_end = (
        polyval(np.diff(knots), polyder(rise, order), tensor=False) for order in range(3)
    )
    y = np.diff(c[0]) + np.diff(lows) - ends[:-1]
    turn = c[1, 1:] - slope_end[:-1]
    bend = 2 * c[2, 1:] - bend_end[:-1]
    # Past the ends it goes on straight: the bend there jumps to 0.
    inner = knots[1:-1]
    off = np.maximum(np.abs(y), np.abs(turn))
    kinked = off > JOINED
    bent = np.abs(bend) > BENT * (1e-6 + np.max(np.abs(c[2])))
    edges = [(knots[0], 2 * c[2, 0]), (knots[-1], bend_end[-1])]
    outer = [at for at, jump in edges if abs(jump) > BENT * np.max(np.abs(c[2]))]
    missed = float(np.max(off[~kinked], initial=0.0))
    return inner[kinked], np.concatenate([inner[bent], outer]), missed


CELL = 2e-3
"""Length of a cell of the quadrature, at most [m]; its error falls with the fourth power."""
BYTES_A_CELL = 2_000


@dataclass(frozen=True)
class Arc:
    """The integral of q = sqrt(1 + f'^2) from the first edge to each: [cells + 1]."""

    ground: Ground
    edges: Float[np.ndarray, "cells+1"]
    sums: Interval
    bends: Interval
    """q'' over each cell; where the ground is not smooth inside, all that q may do."""

    @classmethod
    def along(cls, ground: Ground, start: float, end: float) -> Arc:
        """Arc length by the midpoint rule with remainder, h q(middle) + h^3 / 24 q''(somewhere)."""
        knots = np.concatenate([ground.knots, ground.kinks, ground.bends])
        knots = np.unique(knots[(knots > start) & (knots < end)])
        count = (end - start) / CELL + len(knots)
        require_memory(f"a drive of {end - start:.6g} m", "cells", count, BYTES_A_CELL)
        even = np.linspace(start, end, int(np.ceil((end - start) / CELL)) + 1)
        edges = np.unique(np.concatenate([even, knots]))
        left, right = edges[:-1], edges[1:]
        inner = Interval(np.nextafter(left, right), np.nextafter(right, left))
        _, m, f2, f3 = ground.profile(inner)
        square = m.square() + 1.0
        bends = (f2.square() / square + m * f3) / square.sqrt()
        pieces = _integral(ground, interval(left), interval(right), bends)
        sums = pieces.map(lambda of: np.concatenate([[0.0], np.cumsum(of)]))
        slack = len(edges) * np.finfo(float).eps * (1 + np.abs(sums.hi))
        return cls(ground, edges, Interval(sums.lo - slack, sums.hi + slack), bends)

    def at(self, x: Interval) -> Interval:
        """S(x) for narrow x that lie between the ends."""
        cell = np.clip(np.searchsorted(self.edges, x.middle, "right") - 1, 0, len(self.edges) - 2)
        begin = interval(self.edges[cell])
        rest = _integral(self.ground, begin, interval(x.middle), self.bends[cell])
        # The rest of x, over which q is at least 1 and at most what the slope there says.
        steep = (self.ground.profile(x)[1].square() + 1.0).sqrt()
        off = (x - x.middle) * Interval(np.ones(x.shape), steep.hi)
        return self.sums[cell] + rest + off


def _integral(ground: Ground, a: Interval, b: Interval, bend: Interval) -> Interval:
    """Integral of q from a to b, thin numbers within a cell; bend: q'' there."""
    h = b - a
    q = (ground.profile(a + h * 0.5)[1].square() + 1.0).sqrt()
    return h * q + h * h.square() * bend / 24.0
