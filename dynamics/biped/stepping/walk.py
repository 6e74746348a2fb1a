"""The integrators' running state, its queries and updates, and the ends of a walk."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp

from stickslip.dynamics.biped.contact import Torque, ankle_moment, fall_under, mode_of, patch_at
from stickslip.dynamics.biped.inertia import GroundMoment
from stickslip.dynamics.biped.links import SUPPORT_END, SUPPORT_START
from stickslip.dynamics.biped.settings import EventExact, RK4Split
from stickslip.dynamics.pytrees import all_finite
from stickslip.dynamics.scene import Grip, Patches, Smoothed
from stickslip.dynamics.status import EventKind, Status

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jax.typing import DTypeLike
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.dynamics.biped.contact import Coefficients, Friction, Motion, System
    from stickslip.dynamics.biped.model import BipedModel
    from stickslip.dynamics.biped.settings import Integrator
    from stickslip.dynamics.biped.state import BipedState
    from stickslip.dynamics.scene import Scene


END = len(EventKind)
"""The kind of event that is a walk's end by a status: part of no log."""

PHASE_SLACK = 1e-3
"""Tolerance for a start outside the support phase [rad]."""


class EventLog(NamedTuple):
    """Events in order: time left at each, its kind and the crank angle."""

    left: Float[Array, " rows"]
    kinds: Int[Array, " rows"]
    angles: Float[Array, " rows"]


class Walk(NamedTuple):
    """The integrator's running state within one call."""

    phase: Float[Array, ""]
    crank_rate: Float[Array, ""]
    foot_position: Float[Array, ""]
    foot_velocity: Float[Array, ""]
    steps: Int[Array, ""]
    patch: Int[Array, ""]
    left: Float[Array, ""]
    """Time still to go; the call ends at 0 or at a terminal status."""
    aim: Float[Array, ""]
    """Length of the next trial."""
    size: Float[Array, ""] | None
    """The adaptive integrator's step where nothing cuts it short; None for fixed steps."""
    target: Int[Array, ""]
    """Kind of event that the next trial is aimed at."""
    breakaway: Float[Array, ""]
    """Direction of sliding that has begun at velocity zero, else 0."""
    status: Int[Array, ""]
    switches: Int[Array, ""]
    distance: Float[Array, ""]
    work: Float[Array, ""]
    positive_work: Float[Array, ""]
    trials: Int[Array, ""]
    log: EventLog | None
    """The events so far, where they are recorded."""


def mode_at(
    system: System, friction: Friction | None, walk: Walk, inertia: Coefficients
) -> Float[Array, ""]:
    """The mode that a step from here is taken in (eq. 32); always 0 on a smoothed floor."""
    if friction is None or isinstance(system.scene.floor, Smoothed):
        return jnp.zeros_like(walk.phase)
    still = system.still(inertia, walk.crank_rate)
    mode = mode_of(still, walk.foot_velocity, friction.mu_static)
    return jnp.where(walk.breakaway != 0, walk.breakaway, mode)


def start(spec: Integrator, system: System, state: BipedState) -> Walk:
    """The running state at the beginning of a call; its status is OK or the error of the input."""
    duration, model = system.duration, system.model
    dtype = duration.dtype
    zero, none = jnp.zeros((), dtype), jnp.zeros((), jnp.int32)
    value = partial(jnp.asarray, dtype=dtype)
    rate, log, size, aim = value(state.crank_rate), None, None, duration
    if spec.record_events:
        rows = spec.log_size
        log = EventLog(jnp.zeros(rows, dtype), jnp.zeros(rows, jnp.int32), jnp.zeros(rows, dtype))
    if isinstance(spec, EventExact):  # a first step that is seldom too long
        size = jnp.minimum(duration, 0.05 * spec.rtol**0.2)
        aim = within_turn(spec, size, rate)
    elif isinstance(spec, RK4Split):
        aim = duration / spec.substeps
    given = (state, system.drive, duration, system.scene.floor, model.total_mass, model.step_length)
    phase = value(state.phase)
    status = jnp.where(_supports(phase), none, Status.NO_SOLUTION)
    walk = Walk(
        phase=phase,
        crank_rate=rate,
        foot_position=value(state.foot_position),
        foot_velocity=value(state.foot_velocity),
        steps=jnp.asarray(state.steps, jnp.int32),
        patch=none,
        left=duration,
        aim=aim,
        size=size,
        target=none,
        breakaway=zero,
        status=jnp.where(all_finite(given), status, Status.NON_FINITE).astype(jnp.int32),
        switches=none,
        distance=zero,
        work=zero,
        positive_work=zero,
        trials=none - 1,  # the blank trial before the first is settled, too
        log=log,
    )
    return on_its_patch(system, walk)


def on_its_patch(system: System, walk: Walk, where: Bool[Array, ""] | bool = True) -> Walk:
    """The walk with its patch looked up by the foot's place on the floor, where `where`."""
    floor = system.scene.floor
    if not isinstance(floor, Patches):
        return walk
    steps = walk.steps.astype(walk.foot_position.dtype)
    place = steps * system.model.step_length + walk.foot_position
    found = patch_at(floor, place, walk.foot_velocity)
    return walk._replace(patch=jnp.where(where, found, walk.patch))


def within_turn(
    spec: EventExact, size: Float[Array, ""], rate: Float[Array, ""]
) -> Float[Array, ""]:
    """A step no longer than `size` in which the crank turns by no more than allowed."""
    turn = jax.lax.stop_gradient(jnp.abs(rate) * size)
    return size * jnp.minimum(1.0, spec.max_turn / jnp.maximum(turn, spec.max_turn))


def bounds(dtype: DTypeLike) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Ends of the support phase in the working precision."""
    return jnp.asarray(SUPPORT_START, dtype), jnp.asarray(SUPPORT_END, dtype)


def _supports(phase: Float[Array, ""]) -> Bool[Array, ""]:
    """True if the leg carries the weight at this crank angle, or nearly."""
    low, high = bounds(phase.dtype)
    return (phase > low - PHASE_SLACK) & (phase < high + PHASE_SLACK)


def status_at(
    system: System,
    walk: Walk,
    first: Motion,
    ground: Ground,
    step: Float[Array, ""],
    end: Sequence[Float[Array, ""]],
) -> Int[Array, ""]:
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
    solvable = system.model.closes & _supports(walk.phase)
    status = jnp.where(solvable, status, Status.NO_SOLUTION)
    return jnp.where(begins, status, Status.NON_FINITE).astype(jnp.int32)


def hand_over(
    system: System, walk: Walk, exchange: Bool[Array, ""], landed: Bool[Array, ""] | None = None
) -> Walk:
    """Pass the support to the other foot where `exchange`, or end the walk there.

    landed: where the patch is looked up; default: at the exchange.
    """
    model, scene = system.model, system.scene
    low, high = bounds(walk.phase.dtype)
    one = scene.steps == "one"
    stops = exchange if one else exchange & ~model.symmetric
    word = Status.STEP_COMPLETE if one else Status.NO_EXCHANGE
    passes = exchange & ~stops
    turn = jnp.where(passes, jnp.where(walk.phase > jnp.pi, 1, -1), 0).astype(jnp.int32)
    theta = walk.phase - turn.astype(low.dtype) * (high - low)
    walk = walk._replace(
        phase=jnp.where(exchange, jnp.clip(theta, low, high), walk.phase),
        steps=walk.steps + turn,
        status=jnp.where(stops, word, walk.status).astype(jnp.int32),
    )
    return on_its_patch(system, walk, exchange if landed is None else landed)


def note(walk: Walk, happens: Bool[Array, ""], kind: Int[Array, ""] | EventKind) -> Walk:
    """Count an event, and write it down where events are recorded."""
    kind = jnp.full_like(walk.status, kind)
    log = walk.log
    if log is not None:
        angle = walk.phase + jnp.pi * walk.steps.astype(walk.phase.dtype)
        place = jnp.minimum(walk.switches, log.left.shape[0] - 1)
        log = jax.tree.map(
            lambda row, new: row.at[place].set(
                jnp.where(happens, new.astype(row.dtype), row[place])
            ),
            log,
            EventLog(walk.left, kind, angle),
        )
    slips = happens & (kind == EventKind.SLIP)
    return walk._replace(
        switches=walk.switches + happens.astype(jnp.int32),
        status=jnp.where(slips, Status.SLIP_ONSET, walk.status).astype(jnp.int32),
        log=log,
    )


def slips_freely(scene: Scene) -> bool:
    """True if the floor has no switching of its own: no slip at all, or smoothed friction."""
    return isinstance(scene.floor, Grip | Smoothed)


class Midpoint(NamedTuple):
    """Quantities at a step's middle that event detection needs."""

    crank_acceleration: Float[Array, ""]
    foot_acceleration: Float[Array, ""]
    normal_force: Float[Array, ""]
    solvability: Float[Array, ""]
    cone_margin: Float[Array, ""]
    """Margin of the static friction cone [N]."""


class Ground(NamedTuple):
    """Ground forces at one instant, from which the ends are detected."""

    crank_rate: Float[Array, ""]
    normal: Float[Array, ""]
    solvability: Float[Array, ""]
    moment: Float[Array, ""] | None
    """Moment of the ground's force about the ankle [N m]; None where toppling is not judged."""


class Ending(NamedTuple):
    """An end and its margin at the start, the middle and the end of a trial step."""

    status: Int[Array, ""]
    margins: tuple[Array, Array, Array]


def lever_at(system: System, theta: Float[Array, ""]) -> GroundMoment | None:
    """Terms of the ground's moment; None where toppling is not detected."""
    judged = system.scene.outputs != "state"
    return system.model.inertia.moment_at(theta) if judged else None


def ground_of(
    system: System,
    crank_rate: Float[Array, ""],
    motion: Motion | Midpoint,
    lever: GroundMoment | None,
) -> Ground:
    """Ground forces of a motion, from which the ends are detected."""
    moment = None
    if lever is not None:
        accelerations = motion.crank_acceleration, motion.foot_acceleration
        moment = ankle_moment(system.model, lever, crank_rate, *accelerations)
    return Ground(crank_rate, motion.normal_force, motion.solvability, moment)


def levers_of(
    system: System, phases: Sequence[Float[Array, ""]], now: Coefficients, later: Coefficients
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


def _off_foot(model: BipedModel, normal: Array, moment: Array) -> Bool[Array, ""]:
    """True where the zero-moment point lies beyond the toe or the heel."""
    return (moment > model.toe * normal) | (-moment > model.heel * normal)


def _status_now(system: System, at: Ground) -> Int[Array, ""]:
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
    best = _ending(Status.LIFT_OFF, normals)
    if moments:
        margins = _edge_margins(system, normals, moments)
        best = _ending(fall_under(system.model, normals[2]), margins)
    if isinstance(system.drive, Torque) and not isinstance(system.scene.floor, Grip):
        best = _earlier(best, _ending(Status.NO_SOLUTION, [at.solvability for at in samples]))
    if system.max_rate is not None:
        room = [system.max_rate - jnp.abs(at.crank_rate) for at in samples]
        best = _earlier(best, _ending(Status.RUNAWAY, room))
    return best


def _edge_margins(system: System, normals: list[Array], moments: list[Array]) -> list[Array]:
    """(Edge - zero-moment point) times normal force [N m], of the edge that is left first."""
    toe, heel = system.model.toe, system.model.heel
    off_in_middle = _off_foot(system.model, normals[1], moments[1])
    forwards = jnp.where(off_in_middle, moments[1], moments[2]) > 0
    edge, sign = jnp.where(forwards, toe, heel), jnp.where(forwards, 1.0, -1.0)
    return [edge * force - sign * moment for force, moment in zip(normals, moments, strict=True)]


def _ending(status: Status | Int[Array, ""], margins: list[Array]) -> Ending:
    start, middle, end = margins
    return Ending(jnp.full_like(start, status, jnp.int32), (start, middle, end))


def _earlier(one: Ending, other: Ending) -> Ending:
    """The earlier end, by straight lines through the half step in which the first sign changes."""
    by_middle = (one.margins[1] < 0) | (other.margins[1] < 0)

    def half(ending: Ending) -> tuple[Array, Array]:
        start, middle, end = ending.margins
        return jnp.where(by_middle, start, middle), jnp.where(by_middle, middle, end)

    (before, after), (before_other, after_other) = half(one), half(other)
    sooner: Bool[Array, ""] = before * after_other >= before_other * after
    return jax.tree.map(lambda a, b: jnp.where(sooner, a, b), one, other)
