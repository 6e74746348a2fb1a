"""Finding where an event function, positive before and negative after, first crosses zero.

Each function is known at the start, the middle and the end of a trial step; time runs from 0 to 1.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jaxtyping import Array, Bool, Float

    Samples = Sequence[Float[Array, ""]]
    """Samples at the start, the middle and the end of a trial step."""


class Crossing(NamedTuple):
    """The first crossing of one event function, in fractions of the trial step."""

    time: Float[Array, ""]
    """When, infinite if there is none."""
    close: Bool[Array, ""]
    """True if the step's end is so near that a correction to `time` keeps the order."""


def first_crossing(
    samples: Samples,
    end_slope: Float[Array, ""],
    targeted: Bool[Array, ""],
    nearness: float,
    reach: float,
    start_slope: Float[Array, ""] | None = None,
    *,
    dips: bool = False,
) -> Crossing:
    """First crossing of the parabola through three samples, or Newton's from the end if close.

    end_slope: derivative at the end, per trial step. targeted: the step was aimed at this event, so
    an end just short of it counts as having reached it, and one further short of it is aimed again
    (time > 1). nearness: the fraction of the step within which an event is close to its end; reach:
    that within which one is aimed at again. start_slope: derivative at the start, for a function
    that may be zero there and rise: a parabola through samples far beyond its way up would have it
    cross at the start itself. dips: a parabola below zero between two samples crosses, too.
    """
    start, middle, end = samples
    linear = -3 * start + 4 * middle - end
    square = 2 * start - 4 * middle + 2 * end
    crossed = (middle < 0) | (end < 0)
    falling = end_slope < 0
    correction = -end / jnp.where(falling, end_slope, -1.0)
    near_end = falling & (jnp.abs(correction) <= nearness) & (middle >= 0)
    close = near_end & ((end < 0) | targeted)
    parabola = _first_root(start, linear, square)
    if start_slope is not None:
        parabola = jnp.where((start == 0) & (middle < 0), _return(start_slope, middle), parabola)
    # the samples say in which half the sign changes; the parabola only where in it
    within = jnp.where(middle < 0, jnp.minimum(parabola, 0.5), jnp.clip(parabola, 0.5, 1.0))
    if dips:
        dip = (linear < 0) & (-linear < 2 * square) & (linear**2 > 4 * square * start) & ~crossed
        within, crossed = jnp.where(dip, parabola, within), crossed | dip
    short = targeted & falling & ~crossed & (correction <= reach)
    time = jnp.where(crossed, within, jnp.where(short, 1 + correction, jnp.inf))
    time = jnp.where(close, 1 + correction, time)
    return Crossing(time, close)


def _return(slope: Float[Array, ""], middle: Float[Array, ""]) -> Float[Array, ""]:
    """When the parabola that leaves zero with a slope and is below zero at 1/2 is back at zero; 0
    if it does not rise."""
    rise = jnp.maximum(slope, 0.0) / 2
    return rise / 2 / jnp.where(middle < 0, rise - middle, 1.0)


def parabola_slope(samples: Samples) -> Float[Array, ""]:
    """Slope at the end, per trial step, of the parabola through three samples."""
    start, middle, end = samples
    return start - 4 * middle + 3 * end


def _first_root(
    start: Float[Array, ""], linear: Float[Array, ""], square: Float[Array, ""]
) -> Float[Array, ""]:
    """Least positive root of start + linear s + square s^2 where it falls through zero."""
    discriminant = linear**2 - 4 * square * start
    positive = discriminant > 0
    root = jnp.where(positive, jnp.sqrt(jnp.where(positive, discriminant, 1.0)), 0.0)
    rising = linear > 0
    top = jnp.where(rising, -linear - root, 2 * start)
    bottom = jnp.where(rising, 2 * square, root - linear)
    usable = jnp.where(rising, bottom < 0, bottom > 0)
    return jnp.clip(jnp.where(usable, top / jnp.where(usable, bottom, 1.0), 0.0), 0.0, 1.0)
