"""Ground that is proved to be nowhere hollower than a wheel, from the ground's own numbers.

Along the ground the sine of the slope angle changes by at most f'' for each metre of x, along the
lower half of a circle of radius r by 1 / r. Where f'' < 1 / r everywhere, the ground therefore
stays below a wheel that touches it, wherever it does, and nothing has to be looked up under the
wheel. What is no such ground may still carry the wheel: then one has to look.
"""

from __future__ import annotations

from functools import singledispatch
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.ugv.ground.roughness import Waves
from stickslip.dynamics.ugv.ground.shapes import (
    Bump,
    Ditch,
    Flat,
    Incline,
    Ramp,
    Sinusoid,
    Step,
    as_floats,
)
from stickslip.dynamics.ugv.ground.spline import Spline

if TYPE_CHECKING:
    from jaxtyping import Array, Bool

    from stickslip.dynamics.ugv.ground.shapes import Values

MARGIN = 1 / 16
"""Margin from 1 / r, relative, for rounding and for jumps of a spline's slope by rounding."""
MOST_PIECES = 2**11
"""Most pieces of a spline that are searched in a kernel."""
POWERS = 6
"""Greatest order of a spline's polynomials."""
STEEPEST = 8.0
"""Slope at a spline's knots up to which MARGIN covers the jumps."""
BUMP = 4 * np.exp(-1.5)
"""Greatest second derivative of exp(-z^2), beside the foot; at the top it is -2."""
RISE = 10 / np.sqrt(3)
"""Greatest second derivative of the quintic rise from 0 to 1 over a length of 1."""


def nowhere_hollow(shape: object, radius: Values | float) -> Bool[Array, "..."] | None:
    """True if a wheel of this radius [m] is proved to touch the ground at one point, wherever it
    stands; None where nothing is known of the shape."""
    bend = greatest_bend(shape, radius)
    if bend is None:
        return None
    bend, radius = as_floats(bend, radius)
    return radius * bend <= 1 - MARGIN


@singledispatch
def greatest_bend(shape: object, radius: Values | float) -> Values | None:
    """A number that the second derivative exceeds nowhere [1/m]; infinite or None: not known."""
    del shape, radius
    return None


@greatest_bend.register(Flat)
def _(shape: Flat, radius: Values | float) -> Values:
    (r,) = as_floats(radius)
    return jnp.zeros_like(r)


@greatest_bend.register(Incline)
def _(shape: Incline, radius: Values | float) -> Values:
    (m,) = as_floats(shape.slope)
    return jnp.zeros_like(m)


@greatest_bend.register(Bump)
def _(shape: Bump, radius: Values | float) -> Values:
    h, w = as_floats(shape.height, shape.width)
    return jnp.where(h > 0, BUMP * h, -2 * h) / w**2


@greatest_bend.register(Sinusoid)
def _(shape: Sinusoid, radius: Values | float) -> Values:
    a, wavelength = as_floats(shape.amplitude, shape.wavelength)
    return jnp.abs(a) * (2 * np.pi / wavelength) ** 2


@greatest_bend.register(Ramp)
def _(shape: Ramp, radius: Values | float) -> Values:
    m, joint = as_floats(shape.slope, shape.joint)
    return 1.5 * jnp.abs(m) / joint


@greatest_bend.register(Step)
def _(shape: Step, radius: Values | float) -> Values:
    h, length = as_floats(shape.height, shape.length)
    return RISE * jnp.abs(h) / length**2


@greatest_bend.register(Ditch)
def _(shape: Ditch, radius: Values | float) -> Values:
    depth, width, side = as_floats(shape.depth, shape.width, shape.side)
    sides = jnp.where(side > width, 2.0, 1.0)  # they overlap
    return sides * RISE * jnp.abs(depth) / side**2


@greatest_bend.register(Waves)
def _(shape: Waves, radius: Values | float) -> Values:
    a, n = as_floats(shape.amplitudes, shape.frequencies)
    return jnp.sum(jnp.abs(a) * (2 * np.pi * n) ** 2, axis=-1)


@greatest_bend.register(Spline)
def _(shape: Spline, radius: Values | float) -> Values | None:
    """The largest Bernstein coefficient of each piece, which bounds its polynomial;
    infinite where heights or slopes jump at knots by more than rounding."""
    pieces, powers = shape.coefficients.shape[-2:]
    if pieces > MOST_PIECES or powers > POWERS:
        return None
    numbers = (shape.knots, shape.rests, shape.coefficients, shape.lows, radius)
    knots, rests, rows, lows, r = as_floats(*numbers)
    h = (knots[..., 1:] - knots[..., :-1]) + (rests[..., 1:] - rests[..., :-1])
    zero = jnp.zeros_like(lows)
    # In parts of the piece: what each power adds to the height at its end.
    c0, *c = (rows[..., k] * h**k if k < powers else zero for k in range(POWERS))
    q = [(k + 1) * k * c[k] for k in range(1, POWERS - 1)]
    corners = [q[0], q[0] + q[1] / 3, q[0] + (2 * q[1] + q[2]) / 3, sum(q)]
    most = corners[0]
    for corner in corners[1:]:
        most = jnp.maximum(most, corner)
    bend = jnp.maximum(jnp.max(most / h**2, axis=-1), 0)
    slope = rows[..., 1]
    turn = slope[..., 1:] - (sum((k + 1) * c[k] for k in range(POWERS - 1)) / h)[..., :-1]
    rise = (c0[..., 1:] - c0[..., :-1]) + (lows[..., 1:] - (lows + sum(c))[..., :-1])
    knots_below = 1 + 2 * r / jnp.min(h, axis=-1)
    eps = jnp.finfo(h.dtype).eps
    turn, rise = (knots_below * jnp.max(of, axis=-1, initial=0) for of in (turn, rise))
    steep = jnp.max(jnp.abs(slope), axis=-1)
    smooth = (turn <= jnp.sqrt(eps) / 16) & (rise <= 64 * eps * r) & (steep <= STEEPEST)
    return jnp.where(smooth, bend, jnp.inf)
