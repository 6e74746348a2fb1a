"""Runge-Kutta steps in one mode, and the first crossing of an event function inside a step.

The steps are the classical one, and Dormand and Prince's pair. An event function is positive before
an event and negative after, and is known at the start, the middle and the end of a trial step; time
runs from 0 to 1.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.contact import EDGE_ROUNDINGS, CrankMotion
from stickslip.dynamics.biped.stepping.walk import Midpoint, within_turn
from stickslip.dynamics.scene import Smoothed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jaxtyping import Array, Bool, Float

    from stickslip.dynamics.biped.contact import Coefficients, Friction, Motion, System
    from stickslip.dynamics.biped.settings import EventExact
    from stickslip.dynamics.biped.stepping.walk import Walk

    Samples = Sequence[Float[Array, ""]]
    """Samples at the start, the middle and the end of a trial step."""


class Taken(NamedTuple):
    """Result of one step, with the quantities that event detection needs."""

    phase: Float[Array, ""]
    crank_rate: Float[Array, ""]
    foot_position: Float[Array, ""]
    foot_velocity: Float[Array, ""]
    end: Motion
    """The motion at the end."""
    inertia: Coefficients
    """There."""
    middle: Midpoint
    work: Float[Array, ""] | None
    """Work of the motor [J], where its torque is not given."""
    errors: Float[Array, " 4"]
    """Estimated errors of theta, rate, slide and velocity, 0 where there are no estimates."""


def cone_margin(friction: Friction | None, motion: Motion):
    """Margin of the static friction cone [N]."""
    if friction is None:
        return jnp.ones_like(motion.normal_force)
    return friction.mu_static * motion.normal_force - jnp.abs(motion.friction_force)


def _midpoint(friction: Friction | None, motion: Motion) -> Midpoint:
    accelerations = motion.crank_acceleration, motion.foot_acceleration
    margin = cone_margin(friction, motion)
    return Midpoint(*accelerations, motion.normal_force, motion.solvability, margin)


class _Stages(NamedTuple):
    """Carried through the four stages: the current one's place and the weighted sums so far."""

    phase: Array
    crank_rate: Array
    foot_velocity: Array | None
    inertia: Coefficients
    sum_rate: Array
    sum_alpha: Array
    sum_foot: Array
    sum_slide: Array
    sum_power: Array | None
    middle: Midpoint
    """The mean of the second and third stage, whose errors of second order are opposite."""


def classical_step(
    system: System, friction: Friction | None, mode, walk: Walk, inertia: Coefficients, step
) -> Taken:
    """The classical fourth-order step, as a loop so that the inertia is compiled once."""
    last = _classical_stages(system, friction, mode, walk, inertia, step)
    velocity, slide = walk.foot_velocity, walk.foot_position
    if friction is not None:
        velocity = walk.foot_velocity + step * last.sum_foot
        slide = walk.foot_position + step * (walk.foot_velocity + step * last.sum_slide)
    return Taken(
        phase=last.phase,
        crank_rate=last.crank_rate,
        foot_position=slide,
        foot_velocity=velocity,
        end=system.motion(friction, mode, last.inertia, last.crank_rate, velocity),
        inertia=last.inertia,
        middle=last.middle,
        work=None if last.sum_power is None else step * last.sum_power,
        errors=jnp.zeros(4, walk.phase.dtype),
    )


def _classical_stages(
    system: System, friction: Friction | None, mode, walk: Walk, inertia: Coefficients, step
) -> _Stages:
    dtype = walk.phase.dtype
    shares = jnp.asarray([0.5, 0.5, 1.0, 1.0], dtype)
    weights = jnp.asarray([1 / 6, 1 / 3, 1 / 3, 1 / 6], dtype)
    slide_weights = jnp.asarray([1 / 6, 1 / 6, 1 / 6, 0.0], dtype)

    def body(index, now: _Stages) -> _Stages:
        velocity = walk.foot_velocity if now.foot_velocity is None else now.foot_velocity
        motion = system.motion(friction, mode, now.inertia, now.crank_rate, velocity)
        alpha, foot = motion.crank_acceleration, motion.foot_acceleration
        sum_rate = now.sum_rate + weights[index] * now.crank_rate
        sum_alpha = now.sum_alpha + weights[index] * alpha
        last = index == 3
        theta = walk.phase + step * jnp.where(last, sum_rate, shares[index] * now.crank_rate)
        rate = walk.crank_rate + step * jnp.where(last, sum_alpha, shares[index] * alpha)
        halfway = (index == 1) | (index == 2)
        now_here = _midpoint(friction, motion)
        sum_power = now.sum_power
        if sum_power is not None:
            sum_power = sum_power + weights[index] * motion.torque * now.crank_rate
        if now.foot_velocity is not None:
            velocity = walk.foot_velocity + step * shares[index] * foot
        return _Stages(
            phase=theta,
            crank_rate=rate,
            foot_velocity=None if now.foot_velocity is None else velocity,
            inertia=system.model.inertia.at(theta),
            sum_rate=sum_rate,
            sum_alpha=sum_alpha,
            sum_foot=now.sum_foot + weights[index] * foot,
            sum_slide=now.sum_slide + slide_weights[index] * foot,
            sum_power=sum_power,
            middle=jax.tree.map(
                lambda new, old: old + jnp.where(halfway, new / 2, 0.0), now_here, now.middle
            ),
        )

    zero = jnp.zeros_like(walk.phase)
    begin = _Stages(
        phase=walk.phase,
        crank_rate=walk.crank_rate,
        foot_velocity=walk.foot_velocity if isinstance(system.scene.floor, Smoothed) else None,
        inertia=inertia,
        sum_rate=zero,
        sum_alpha=zero,
        sum_foot=zero,
        sum_slide=zero,
        sum_power=zero if isinstance(system.drive, CrankMotion) else None,
        middle=Midpoint(*[zero] * len(Midpoint._fields)),
    )
    return jax.lax.fori_loop(0, 4, body, begin)


# Dormand and Prince, J. Comp. Appl. Math. 6 (1980): the seven stages, the seventh at the end; the
# fifth-order solution minus the fourth-order one; and, as an eighth row, Shampine's fourth-order
# interpolant at the midpoint (Hairer, Norsett, Wanner, Solving ODEs I, II.6).
_ROWS = (
    (),
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
    (
        6025192743 / 60171106304,
        0.0,
        51252292925 / 130801643196,
        -2691868925 / 90256659456,
        187940372067 / 3189068634112,
        -1776094331 / 39487288512,
        11237099 / 470086768,
    ),
)
TABLEAU = np.array([row + (0.0,) * (8 - len(row)) for row in _ROWS])
ERROR = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40, 0.0])
_END = 6


def dormand_prince_step(system: System, friction: Friction | None, mode, walk: Walk, step) -> Taken:
    """A fifth-order step with error estimates; the eight stages are one loop (see above)."""
    dtype = walk.phase.dtype
    tableau = jnp.asarray(TABLEAU, dtype)
    at_start = jnp.stack([*walk[:4], jnp.zeros_like(walk.phase)])

    def stage(slopes, index):
        theta, rate, slide, velocity, work = at_start + step * _weighted(tableau[index], slopes)
        inertia = system.model.inertia.at(theta)
        motion = system.motion(friction, mode, inertia, rate, velocity)
        power = motion.torque * rate
        slope = [rate, motion.crank_acceleration, velocity, motion.foot_acceleration, power]
        place = (theta, rate, slide, velocity, work)
        row = jnp.stack(slope)
        slopes = jax.lax.dynamic_update_index_in_dim(slopes, row, index, 0)
        return slopes, (place, motion, inertia)

    slopes, (places, motions, inertias) = jax.lax.scan(
        stage, jnp.zeros((len(_ROWS), len(at_start)), dtype), jnp.arange(len(_ROWS))
    )
    theta, rate, slide, velocity, work = (column[_END] for column in places)
    end, middle = (jax.tree.map(lambda row, at=at: row[at], motions) for at in (_END, _END + 1))
    inertia = jax.tree.map(lambda row: row[_END], inertias)
    errors = step * _weighted(jnp.asarray(ERROR, dtype), slopes[:, :4])
    return Taken(
        phase=theta,
        crank_rate=rate,
        foot_position=slide if friction is not None else walk.foot_position,
        foot_velocity=velocity if friction is not None else walk.foot_velocity,
        end=end,
        inertia=inertia,
        middle=_midpoint(friction, middle),
        work=work if isinstance(system.drive, CrankMotion) else None,
        errors=errors,
    )


def _weighted(weights: Float[Array, " stages"], slopes: Float[Array, "stages n"]):
    """Sum of the slopes by their weights; no matrix product, which would be no part of a kernel."""
    return jnp.sum(weights[:, None] * slopes, axis=0)


def next_size(spec: EventExact, system: System, walk: Walk, taken: Taken, step):
    """The next step's size by the estimated error, and whether this step fails its tolerance.

    Sizes are choices, not functions of the state: no derivative goes through them.
    """
    dtype = step.dtype
    rtol = max(spec.rtol, 32 * float(jnp.finfo(dtype).eps))
    start, end = jnp.stack(walk[:4]), jnp.stack(taken[:4])
    # what roundings of the weight make of a step: near rest nothing is known to a part of itself
    gravity = jnp.asarray(system.model.gravity, dtype)
    turn = gravity / system.model.step_length
    known = jnp.stack([turn * step**2, turn * step, gravity * step**2, gravity * step])
    rounded = EDGE_ROUNDINGS * jnp.finfo(dtype).eps * known
    allowed = spec.atol + rtol * jnp.maximum(jnp.abs(start), jnp.abs(end)) + rounded
    worst = jax.lax.stop_gradient(jnp.max(jnp.abs(taken.errors) / allowed))
    worst = jnp.where(jnp.isfinite(worst), worst, jnp.inf)
    factor = jnp.clip(0.9 * jnp.maximum(worst, 1e-10) ** -0.2, 0.2, 5.0)
    fails = (worst > 1) & (step > system.tiny())
    before = step if walk.size is None else walk.size
    kept = jax.lax.stop_gradient(jnp.maximum(before, step))  # a step cut short says little
    plain = jax.lax.stop_gradient(step)
    size = jnp.where(fails, plain * factor, jnp.where(step < before, kept, plain * factor))
    rate = jnp.where(jnp.isfinite(taken.crank_rate), taken.crank_rate, walk.crank_rate)
    return within_turn(spec, size, rate), fails


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
