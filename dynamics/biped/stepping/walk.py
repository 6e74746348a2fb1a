"""The integrators' running state, and its queries and updates."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp

from stickslip.dynamics.biped.contact import mode_of
from stickslip.dynamics.biped.floor import patch_at
from stickslip.dynamics.biped.links import SUPPORT_END, SUPPORT_START
from stickslip.dynamics.biped.stepping.ends import Ground, status_now
from stickslip.dynamics.biped.stepping.integrators import EventExact, RK4Split
from stickslip.dynamics.numeric import all_finite
from stickslip.dynamics.scene import Grip, Patches, Smoothed
from stickslip.dynamics.status import EventKind, Status

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.dynamics.biped.contact import Coefficients, Motion
    from stickslip.dynamics.biped.drive import System
    from stickslip.dynamics.biped.floor import Friction
    from stickslip.dynamics.biped.model import BipedModel
    from stickslip.dynamics.biped.state import BipedState
    from stickslip.dynamics.biped.stepping.integrators import Integrator
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

    theta: Float[Array, ""]
    rate: Float[Array, ""]
    slide: Float[Array, ""]
    velocity: Float[Array, ""]
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
        return jnp.zeros_like(walk.theta)
    still = system.still(inertia, walk.rate)
    mode = mode_of(still, walk.velocity, friction.mu_static)
    return jnp.where(walk.breakaway != 0, walk.breakaway, mode)


def start(
    model: BipedModel,
    scene: Scene,
    state: BipedState,
    duration: Float[Array, ""],
    spec: Integrator,
    dtype: DTypeLike,
) -> Walk:
    """The running state at the beginning of a call."""
    zero, none = jnp.zeros((), dtype), jnp.zeros((), jnp.int32)
    value = partial(jnp.asarray, dtype=dtype)
    steps = jnp.asarray(state.steps, jnp.int32)
    rate = value(state.crank_rate)
    slide, velocity = value(state.foot_position), value(state.foot_velocity)
    log, size = None, None
    if spec.record_events:
        rows = spec.log_size
        log = EventLog(jnp.zeros(rows, dtype), jnp.zeros(rows, jnp.int32), jnp.zeros(rows, dtype))
    aim = duration
    if isinstance(spec, EventExact):  # a first step that is seldom too long
        size = jnp.minimum(duration, 0.05 * spec.rtol**0.2)
        aim = within_turn(spec, size, rate)
    elif isinstance(spec, RK4Split):
        aim = duration / spec.substeps
    walk = Walk(
        theta=value(state.phase),
        rate=rate,
        slide=slide,
        velocity=velocity,
        steps=steps,
        patch=none,
        left=duration,
        aim=aim,
        size=size,
        target=none,
        breakaway=zero,
        status=none,
        switches=none,
        distance=zero,
        work=zero,
        positive_work=zero,
        trials=none - 1,  # the blank trial before the first is settled, too
        log=log,
    )
    return on_its_patch(model, scene, walk)


def on_its_patch(
    model: BipedModel, scene: Scene, walk: Walk, where: Bool[Array, ""] | bool = True
) -> Walk:
    """The walk with its patch looked up by the foot's place on the floor, where `where`."""
    if not isinstance(scene.floor, Patches):
        return walk
    place = walk.steps.astype(walk.slide.dtype) * model.step_length + walk.slide
    found = patch_at(scene.floor, place, walk.velocity)
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


def status_at(
    system: System,
    walk: Walk,
    first: Motion,
    ground: Ground,
    step: Float[Array, ""],
    theta: Float[Array, ""],
    sound: Bool[Array, ""],
) -> Int[Array, ""]:
    """Status of a step to crank angle `theta`: the model holds at its start, the step is valid.

    sound: the numbers at the step's end are finite. The gravest word comes last, so that a step
    that overflows says the same in every precision.
    """
    turn = jnp.maximum(jnp.abs(walk.rate) * step, jnp.abs(theta - walk.theta))
    begins = walk.theta + walk.rate + walk.slide + walk.velocity
    # a drive that is no number makes an acceleration that is none
    begins = jnp.isfinite(begins + first.crank_acceleration + first.foot_acceleration)
    status = jnp.where(sound, jnp.zeros_like(walk.status), Status.NON_FINITE)
    coarse = ~(turn <= jnp.pi / 2)  # a turn that is no number, too
    status = jnp.where(coarse, Status.NOT_CONVERGED, status)
    ended = status_now(system, ground)
    status = jnp.where(ended > Status.OK, ended, status)
    low, high = bounds(walk.theta.dtype)
    supports = (walk.theta > low - PHASE_SLACK) & (walk.theta < high + PHASE_SLACK)
    solvable = system.model.closes & supports
    status = jnp.where(solvable, status, Status.NO_SOLUTION)
    return jnp.where(begins, status, Status.NON_FINITE).astype(jnp.int32)


def entry_status(system: System, walk: Walk, state: BipedState) -> Int[Array, ""]:
    """The status of a call before anything moves: OK, or the error of the input."""
    low, high = bounds(walk.theta.dtype)
    supports = (walk.theta > low - PHASE_SLACK) & (walk.theta < high + PHASE_SLACK)
    status = jnp.where(supports, walk.status, Status.NO_SOLUTION)
    model = system.model
    given = (state, system.drive, system.duration, system.scene.floor)
    given += (model.total_mass, model.step_length)
    return jnp.where(all_finite(given), status, Status.NON_FINITE).astype(jnp.int32)


def hand_over(
    system: System, walk: Walk, exchange: Bool[Array, ""], landed: Bool[Array, ""] | None = None
) -> Walk:
    """Pass the support to the other foot where `exchange`, or end the walk there.

    landed: where the patch is looked up; default: at the exchange.
    """
    model, scene = system.model, system.scene
    low, high = bounds(walk.theta.dtype)
    one = scene.steps == "one"
    stops = exchange if one else exchange & ~model.symmetric
    word = Status.STEP_COMPLETE if one else Status.NO_EXCHANGE
    passes = exchange & ~stops
    turn = jnp.where(passes, jnp.where(walk.theta > jnp.pi, 1, -1), 0).astype(jnp.int32)
    theta = walk.theta - turn.astype(low.dtype) * (high - low)
    walk = walk._replace(
        theta=jnp.where(exchange, jnp.clip(theta, low, high), walk.theta),
        steps=walk.steps + turn,
        status=jnp.where(stops, word, walk.status).astype(jnp.int32),
    )
    return on_its_patch(model, scene, walk, exchange if landed is None else landed)


def note(
    walk: Walk, happens: Bool[Array, ""], kind: Int[Array, ""], left: Float[Array, ""] | None = None
) -> Walk:
    """Count an event, and write it down where events are recorded; left: when, default now."""
    log = walk.log
    if log is not None:
        when = walk.left if left is None else left
        angle = walk.theta + jnp.pi * walk.steps.astype(walk.theta.dtype)
        place = jnp.minimum(walk.switches, log.left.shape[0] - 1)
        log = jax.tree.map(
            lambda row, new: row.at[place].set(
                jnp.where(happens, new.astype(row.dtype), row[place])
            ),
            log,
            EventLog(when, kind, angle),
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
