"""The classical Runge-Kutta step in one mode, event functions inside a step, and a walk's ends.

An event function is positive before an event and negative after, and is known at the start, the
middle and the end of a trial step; time runs from 0 to 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp

from stickslip.dynamics.biped.contact import CrankMotion, ankle_moment, fall_under, torque_held
from stickslip.dynamics.biped.inertia import GroundMoment
from stickslip.dynamics.biped.state import Walk, supports
from stickslip.dynamics.scene import Grip
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped.contact import Coefficients, Friction, Motion, System
    from stickslip.dynamics.biped.model import BipedModel
    from stickslip.dynamics.pytrees import Flag, Integer, Scalar

    Sampled = Sequence[Scalar]
    """Samples at the start, the middle and the end of a trial step."""


class Taken(NamedTuple):
    """Result of one step, with the quantities that event detection needs."""

    phase: Scalar
    crank_rate: Scalar
    foot_position: Scalar
    foot_velocity: Scalar
    end: Motion
    """The motion at the end."""
    inertia: Coefficients
    """There."""
    middle: Midpoint
    work: Scalar | None
    """Work of the motor [J], where its torque is not given."""
    errors: Float[Array, " 4"]
    """Estimated errors of theta, rate, slide and velocity, 0 where there are no estimates."""


class Midpoint(NamedTuple):
    """Quantities at a step's middle that event detection needs."""

    crank_acceleration: Scalar
    foot_acceleration: Scalar
    normal_force: Scalar
    solvability: Scalar
    cone_margin: Scalar


def cone_margin(friction: Friction | None, motion: Motion):
    """Margin of the static friction cone [N]."""
    if friction is None:
        return jnp.ones_like(motion.normal_force)
    return friction.mu_static * motion.normal_force - jnp.abs(motion.friction_force)


def midpoint(friction: Friction | None, motion: Motion) -> Midpoint:
    """Values of a motion that event detection needs."""
    accelerations = motion.crank_acceleration, motion.foot_acceleration
    margin = cone_margin(friction, motion)
    return Midpoint(*accelerations, motion.normal_force, motion.solvability, margin)


class Beginning(NamedTuple):
    """Mode and length of a trial."""

    step: Scalar
    mode: Scalar
    near: Scalar
    """The time within which the event that is aimed at is at once [s]."""
    final: Flag
    """The last trial allowed."""


class Samples(NamedTuple):
    """Start, middle and end of a trial."""

    phase: tuple[Array, Array, Array]
    crank_rate: tuple[Array, Array, Array]
    foot_position: tuple[Array, Array, Array]
    foot_velocity: tuple[Array, Array, Array]
    cone: tuple[Array, Array, Array]
    """See cone_margin."""


class Event(NamedTuple):
    """First event of a trial, if there is one; fields as in Trial."""

    kind: Integer
    ending: Integer
    time: Scalar
    happens: Flag
    reached: Flag
    """The trial's end is close enough to the event to be moved onto it."""


def classical_step(
    system: System, friction: Friction | None, mode, walk: Walk, inertia: Coefficients, step
) -> Taken:
    """The classical fourth-order step, as a loop so that the inertia is compiled once."""
    ends = _classical_stages(system, friction, mode, walk, inertia, step)
    theta, rate, inertia, (_, _, foot, slid, power), middle = ends
    velocity, slide = walk.foot_velocity, walk.foot_position
    if friction is not None:
        velocity = walk.foot_velocity + step * foot
        slide = walk.foot_position + step * (walk.foot_velocity + step * slid)
    return Taken(
        phase=theta,
        crank_rate=rate,
        foot_position=slide,
        foot_velocity=velocity,
        end=system.motion(friction, mode, inertia, rate),
        inertia=inertia,
        middle=middle,
        work=None if power is None else step * power,
        errors=jnp.zeros(4, walk.phase.dtype),
    )


def _classical_stages(
    system: System, friction: Friction | None, mode, walk: Walk, inertia: Coefficients, step
) -> tuple[Array, Array, Coefficients, tuple[Any, ...], Midpoint]:
    """Place after the stages; their weighted sums, of the rate, its slope, the foot's acceleration,
    the same for its slide, and the power; the mean of stages 2 and 3, whose errors are opposite."""
    dtype, zero = walk.phase.dtype, jnp.zeros_like(walk.phase)
    shares = jnp.asarray([0.5, 0.5, 1.0, 1.0], dtype)
    weights = jnp.asarray([1 / 6, 1 / 3, 1 / 3, 1 / 6], dtype)
    slide_weights = jnp.asarray([1 / 6, 1 / 6, 1 / 6, 0.0], dtype)
    power = zero if torque_held(system.drive) is None else None

    def body(index, now):
        _, rate, inertia, sums, middle = now
        motion = system.motion(friction, mode, inertia, rate)
        alpha, foot = motion.crank_acceleration, motion.foot_acceleration
        added = [weights[index] * one for one in (rate, alpha, foot)]
        added.append(slide_weights[index] * foot)
        work = None if power is None else weights[index] * motion.torque * rate
        sums = jax.tree.map(jnp.add, sums, (*added, work))
        last, halfway = index == 3, (index == 1) | (index == 2)
        theta = walk.phase + step * jnp.where(last, sums[0], shares[index] * rate)
        rate = walk.crank_rate + step * jnp.where(last, sums[1], shares[index] * alpha)
        here = midpoint(friction, motion)
        middle = jax.tree.map(lambda new, old: old + jnp.where(halfway, new / 2, 0.0), here, middle)
        return theta, rate, system.model.inertia.at(theta), sums, middle

    middle = Midpoint(*[zero] * len(Midpoint._fields))
    begin = walk.phase, walk.crank_rate, inertia, (*[zero] * 4, power), middle
    return jax.lax.fori_loop(0, 4, body, begin)


def taken_back(begin: Scalar, end: Scalar, work: Scalar, step: Scalar) -> Scalar:
    """The lesser of what a power gives and takes in a step, by the parabola of its values at both
    ends and of the step's work; 0 where both ends have one sign."""
    turns = (begin * end < 0) & (step > 0)
    mean = jnp.where(turns, work / jnp.where(step > 0, step, 1.0), 0.0)
    a, b = jnp.where(turns, begin, 1.0), jnp.where(turns, end, -1.0)
    slope, bend = 6 * mean - 4 * a - 2 * b, 3 * (a + b - 2 * mean)
    root = 2 * a / (jnp.sign(a) * jnp.sqrt(slope**2 - 4 * a * bend) - slope)
    before = root * (a + root * (slope / 2 + root * bend / 3))
    lesser = jnp.minimum(jnp.abs(before), jnp.abs(mean - before))
    return jnp.where(turns, step * lesser, 0.0)


class Crossing(NamedTuple):
    """The first crossing of one event function, in fractions of the trial step."""

    time: Scalar
    """When, infinite if there is none."""
    close: Flag
    """True if the step's end is so near that a correction to `time` keeps the order."""


def first_crossing(
    samples: Sampled,
    end_slope: Scalar,
    targeted: Flag,
    nearness: float,
    reach: float,
    start_slope: Scalar | None = None,
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
        # Second zero of the parabola that rises with this slope at 0 to `middle` < 0 at 1/2; or 0.
        rise = jnp.maximum(start_slope, 0.0) / 2
        back = rise / 2 / jnp.where(middle < 0, rise - middle, 1.0)
        parabola = jnp.where((start == 0) & (middle < 0), back, parabola)
    # the samples say in which half the sign changes; the parabola only where in it
    within = jnp.where(middle < 0, jnp.minimum(parabola, 0.5), jnp.clip(parabola, 0.5, 1.0))
    if dips:
        dip = (linear < 0) & (-linear < 2 * square) & (linear**2 > 4 * square * start) & ~crossed
        within, crossed = jnp.where(dip, parabola, within), crossed | dip
    short = targeted & falling & ~crossed & (correction <= reach)
    time = jnp.where(crossed, within, jnp.where(short, 1 + correction, jnp.inf))
    time = jnp.where(close, 1 + correction, time)
    return Crossing(time, close)


def parabola_slope(samples: Sampled) -> Scalar:
    """Slope at the end, per trial step, of the parabola through three samples."""
    start, middle, end = samples
    return start - 4 * middle + 3 * end


def _first_root(start: Scalar, linear: Scalar, square: Scalar) -> Scalar:
    """Least positive root of start + linear s + square s^2 where it falls through zero."""
    discriminant = linear**2 - 4 * square * start
    positive = discriminant > 0
    root = jnp.where(positive, jnp.sqrt(jnp.where(positive, discriminant, 1.0)), 0.0)
    rising = linear > 0
    top = jnp.where(rising, -linear - root, 2 * start)
    bottom = jnp.where(rising, 2 * square, root - linear)
    usable = jnp.where(rising, bottom < 0, bottom > 0)
    return jnp.clip(jnp.where(usable, top / jnp.where(usable, bottom, 1.0), 0.0), 0.0, 1.0)


def status_at(
    system: System, walk: Walk, first: Motion, ground: Ground, step: Scalar, end: Sequence[Scalar]
) -> Integer:
    """Status of a step: the model holds at its start, the step is valid.

    end: the numbers at its end, the crank angle first. The gravest word comes last, so that a step
    that overflows says the same in every precision.
    """
    turn = jnp.maximum(jnp.abs(walk.crank_rate) * step, jnp.abs(end[0] - walk.phase))
    begins = walk.phase + walk.crank_rate + walk.foot_position + walk.foot_velocity
    # a torque that is no number makes an acceleration that is none
    begins = jnp.isfinite(begins + first.crank_acceleration + first.foot_acceleration)
    sound = jnp.isfinite(sum(end[1:], end[0]))
    status = jnp.where(sound, jnp.zeros_like(walk.status), Status.NON_FINITE)
    coarse = ~(turn <= jnp.pi / 2)  # a turn that is no number, too
    status = jnp.where(coarse, Status.NOT_CONVERGED, status)
    ended = _status_now(system, ground)
    status = jnp.where(ended > Status.OK, ended, status)
    solvable = system.model.closes & supports(walk.phase)
    status = jnp.where(solvable, status, Status.NO_SOLUTION)
    return jnp.where(begins, status, Status.NON_FINITE).astype(jnp.int32)


class Ground(NamedTuple):
    """Ground forces at one instant, from which the ends are detected."""

    crank_rate: Scalar
    normal: Scalar
    solvability: Scalar
    moment: Scalar | None
    """Moment of the ground's force about the ankle [N m]; None where toppling is not judged."""


class Ending(NamedTuple):
    """An end and its margin at the start, the middle and the end of a trial step."""

    status: Integer
    margins: list[Array]


def lever_at(system: System, theta: Scalar) -> GroundMoment | None:
    """Terms of the ground's moment; None where toppling is not detected."""
    judged = system.scene.outputs != "state"
    return system.model.inertia.moment_at(theta) if judged else None


def ground_of(
    system: System, crank_rate: Scalar, motion: Motion | Midpoint, lever: GroundMoment | None
) -> Ground:
    """Ground forces of a motion, from which the ends are detected."""
    moment = None
    if lever is not None:
        accelerations = motion.crank_acceleration, motion.foot_acceleration
        moment = ankle_moment(system.model, lever, crank_rate**2, *accelerations)
    return Ground(crank_rate, motion.normal_force, motion.solvability, moment)


def levers_of(
    system: System, phases: Sequence[Scalar], now: Coefficients, later: Coefficients
) -> tuple[GroundMoment | None, ...]:
    """Moment terms at the start, middle and end of a trial step, with the inertia at its ends.

    L is evaluated at the ends alone: P and Y are slopes of the mass moments, and in between are
    Hermite's cubics. Errors as the turn's fifth power, and in the middle its fourth.
    """
    first = lever_at(system, phases[0])
    if first is None:
        return None, None, None
    L, dL = system.model.inertia.spin_at(phases[2])
    turn = phases[2] - phases[0]
    enough = jnp.abs(turn) > 1e-3  # below, a difference of L has no digits and is not needed
    mean = (first.dL + dL) / 2
    secant = jnp.where(enough, (L - first.L) / jnp.where(enough, turn, 1.0), mean)

    def halfway(a: Array, b: Array, slope: Array, slope_after: Array) -> Array:
        return (a + b) / 2 + turn / 8 * (slope - slope_after)

    def risen(a: Array, slope: Array, slope_after: Array, bend: Array, bend_after: Array) -> Array:
        return a + turn * ((slope + slope_after) / 2 + turn / 12 * (bend - bend_after))

    X = risen(first.X, now.P, later.P, now.dP, later.dP)
    Y = risen(first.Y, now.Y, later.Y, now.dY, later.dY)
    middle = GroundMoment(
        halfway(first.L, L, first.dL, dL),
        1.5 * secant - mean / 2,
        halfway(first.X, X, now.P, later.P),
        halfway(first.Y, Y, now.Y, later.Y),
    )
    return first, middle, GroundMoment(L, dL, X, Y)


def _off_foot(model: BipedModel, normal: Array, moment: Array) -> Flag:
    """True where the zero-moment point lies beyond the toe or the heel."""
    return (moment > model.toe * normal) | (-moment > model.heel * normal)


def _status_now(system: System, at: Ground) -> Integer:
    """OK, or the most severe end at this instant."""
    status = jnp.zeros_like(at.normal, jnp.int32)
    if at.moment is not None:
        off_foot = _off_foot(system.model, at.normal, at.moment)
        status = jnp.where(off_foot, fall_under(system.model, at.normal), status)
    if system.max_rate is not None:
        status = jnp.where(jnp.abs(at.crank_rate) > system.max_rate, Status.RUNAWAY, status)
    status = jnp.where(at.normal <= 0, Status.LIFT_OFF, status)
    return jnp.where(at.solvability > 0, status, Status.NO_SOLUTION).astype(jnp.int32)


def first_ending(system: System, samples: Sequence[Ground]) -> Ending:
    """The end whose margin is the first to cross zero along straight lines through the samples."""
    normals = [at.normal for at in samples]
    moments = [at.moment for at in samples if at.moment is not None]
    ends: list[tuple[Any, list[Array]]] = [(Status.LIFT_OFF, normals)]
    if moments:  # (edge - zero-moment point) times normal force [N m], of the edge left first
        off_in_middle = _off_foot(system.model, normals[1], moments[1])
        forwards = jnp.where(off_in_middle, moments[1], moments[2]) > 0
        edge = jnp.where(forwards, system.model.toe, system.model.heel)
        sign = jnp.where(forwards, 1.0, -1.0)
        margins = [edge * N - sign * moment for N, moment in zip(normals, moments, strict=True)]
        ends = [(fall_under(system.model, normals[2]), margins)]
    if not isinstance(system.drive, CrankMotion) and not isinstance(system.scene.floor, Grip):
        ends.append((Status.NO_SOLUTION, [at.solvability for at in samples]))
    if system.max_rate is not None:
        ends.append((Status.RUNAWAY, [system.max_rate - abs(at.crank_rate) for at in samples]))
    every = [Ending(jnp.full_like(of[0], why, jnp.int32), of) for why, of in ends]
    return reduce(_earlier, every)


def _earlier(one: Ending, other: Ending) -> Ending:
    """The earlier end, by straight lines through the half step in which the first sign changes."""
    by_middle = (one.margins[1] < 0) | (other.margins[1] < 0)
    (before, after), (before_other, after_other) = (
        (jnp.where(by_middle, start, middle), jnp.where(by_middle, middle, end))
        for start, middle, end in (one.margins, other.margins)
    )
    sooner: Flag = before * after_other >= before_other * after
    return jax.tree.map(lambda a, b: jnp.where(sooner, a, b), one, other)
