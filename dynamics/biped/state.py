"""The biped's state between steps and within one, the contact report of a step, a trajectory."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import pytrees
from stickslip.dynamics.biped.contact import mode_of, patch_at
from stickslip.dynamics.biped.links import SUPPORT_END, SUPPORT_START, step_length
from stickslip.dynamics.biped.model import BipedModel
from stickslip.dynamics.biped.settings import EventExact, Integrator, RK4Split
from stickslip.dynamics.checks import is_concrete, require_number
from stickslip.dynamics.scene import Patches
from stickslip.dynamics.status import EventKind, Status

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array, Float, Int

    from stickslip.dynamics.biped.contact import Coefficients, Friction, System
    from stickslip.dynamics.biped.params import BipedParams
    from stickslip.dynamics.pytrees import Flag, Integer, Scalar


@pytrees.pytree_dataclass
class BipedState:
    """State of a walk: `steps` counts exchanges of support, phase and foot_position the rest.

    phase: crank angle of the supporting leg, in [pi/2, 3 pi/2] [rad]. steps: exchanges so far,
    forwards positive (integer). crank_rate [rad/s]. foot_position: slide x1 of eq. (16), the
    supporting ankle's distance from the foothold that `steps` steps without slip lead to [m], kept
    separate from the steps so that single precision holds over long walks. foot_velocity: of the
    supporting foot over the floor, exactly 0 while it is at rest [m/s]. time [s].

    The whole turn of the crank is `crank_angle`, the ankle's place on the floor `floor_position`.
    """

    phase: pytrees.Numeric = SUPPORT_START
    steps: pytrees.Numeric = 0
    crank_rate: pytrees.Numeric = 0.0
    foot_position: pytrees.Numeric = 0.0
    foot_velocity: pytrees.Numeric = 0.0
    time: pytrees.Numeric = 0.0

    @property
    def crank_angle(self) -> Scalar:
        """The crank's angle with no wrapping: phase + pi steps [rad]."""
        phase = jnp.asarray(self.phase)
        return phase + np.pi * jnp.asarray(self.steps).astype(phase.dtype)

    def astype(self, dtype: DTypeLike) -> BipedState:
        """The same state as arrays of `dtype`, and steps as int32; time is no number where steps
        are none, so that a step says NON_FINITE."""
        numbers = {name: jnp.asarray(value, dtype) for name, value in vars(self).items()}
        steps = jnp.asarray(self.steps)
        time = jnp.where(jnp.isfinite(numbers["steps"]), numbers["time"], jnp.nan)
        whole = jnp.issubdtype(steps.dtype, jnp.integer)
        numbers |= {"steps": steps.astype(jnp.int32), "time": numbers["time"] if whole else time}
        return BipedState(**numbers)

    def validate(self) -> BipedState:
        """Return self, or raise ValueError naming a field that no walk can have."""
        pytrees.require_numeric(**vars(self))
        accepted = "a whole number of exchanges, below 2^31"
        require_number("steps", self.steps, low=-(2.0**31), high=2.0**31 - 1, accepted=accepted)
        if is_concrete(self.steps) and np.any(np.asarray(self.steps) % 1 != 0):
            raise ValueError(f"steps = {self.steps}; accepted: {accepted}")
        pytrees.require_broadcast(**vars(self))
        for name in ("phase", "crank_rate", "foot_position", "foot_velocity", "time"):
            require_number(name, getattr(self, name), low=-np.inf, accepted="a finite number")
        return self.require_support()

    def require_support(self) -> BipedState:
        """Return self, or raise ValueError for a phase at which the leg does not support.

        A phase that is not finite passes: a step says NON_FINITE.
        """
        if is_concrete(self.phase):
            phase, slack = np.asarray(self.phase), 1e-6
            if np.any((phase < SUPPORT_START - slack) | (phase > SUPPORT_END + slack)):
                raise ValueError(
                    f"phase = {phase} is not accepted; accepted: the supporting leg's crank angle, "
                    "pi/2 to 3 pi/2 rad (a full turn is counted in steps of pi)"
                )
        return self


def floor_position(params: BipedParams | BipedModel, state: BipedState) -> Scalar:
    """Floor position of the supporting ankle [m]: steps by step length, plus slide."""
    length = params.step_length if isinstance(params, BipedModel) else step_length(params)
    return jnp.asarray(state.steps).astype(length.dtype) * length + state.foot_position


@pytrees.pytree_dataclass
class Contact:
    """The foot on the ground at the end of a step, and what happened during it.

    friction_force, normal_force: ground on foot [N]. zmp: from the ankle forwards [m], None when
    the scene's outputs leave it out. mode: 0 sticks, +1 / -1 slides forwards / backwards. status:
    a Status. switches: stick-slip changes, exchanges and patch edges crossed during the step.
    slide_distance: path of the foot over the floor, >= 0 [m]. torque: of the motor [N m]. work,
    positive_work: of the motor, net and counting only what it gives [J]. joint_forces: [68] N in
    the order of JOINT_FORCES, None unless the scene's outputs are "joints". events: None, or times,
    kinds (EventKind) and crank angles of the switches, unused entries of kind NONE.
    """

    friction_force: Scalar
    normal_force: Scalar
    zmp: Scalar | None
    mode: Integer
    status: Integer
    switches: Integer
    slide_distance: Scalar
    torque: Scalar
    work: Scalar
    positive_work: Scalar
    joint_forces: Float[Array, " 68"] | None
    events: Events | None


@pytrees.pytree_dataclass
class Events:
    """Switching instants within one step, in order; entries past the last have kind NONE."""

    times: Float[Array, " events"]
    kinds: Int[Array, " events"]
    crank_angles: Float[Array, " events"]


@pytrees.pytree_dataclass
class Trajectory:
    """A walk in n steps: states [n + 1] with the initial one, torques and contacts [n].

    After a terminal status the last state and contact stand, and nothing more is done: work,
    positive_work, slide_distance and switches 0 and no events, so that sums are those of the walk.
    """

    states: BipedState
    torques: Float[Array, " n"]
    contacts: Contact

    @property
    def final(self) -> BipedState:
        """The last state."""
        return jax.tree.map(lambda leaf: leaf[-1], self.states)

    @property
    def status(self) -> Status | Integer:
        """The most severe Status of the walk; an integer inside a trace."""
        gravest = jnp.max(self.contacts.status)
        return Status(int(gravest)) if is_concrete(gravest) else gravest

    def events(self) -> list[tuple[float, str, float]]:
        """(time [s], "slip" | "stick" | "exchange" | "patch", crank angle [rad]) in order.

        For one walk, not a batch, and an integrator with record_events=True; else ValueError.
        """
        events = self.contacts.events
        if events is None or np.ndim(events.kinds) != 2:
            raise ValueError(
                "events need one walk simulated with integrator=RK4Split(record_events=True), or "
                "another integrator's record_events=True"
            )
        used = np.asarray(events.kinds) != EventKind.NONE
        rows = (np.asarray(column)[used].tolist() for column in jax.tree.leaves(events))
        return [(t, EventKind(k).name.lower(), angle) for t, k, angle in zip(*rows, strict=True)]


END = len(EventKind)
"""The kind of event that is a walk's end by a status: part of no log."""
PHASE_SLACK = 1e-3
"""Tolerance for a start outside the support phase [rad]."""


class Walk(NamedTuple):
    """The integrator's running state within one call."""

    phase: Scalar
    crank_rate: Scalar
    foot_position: Scalar
    foot_velocity: Scalar
    steps: Integer
    patch: Integer
    left: Scalar
    """Time still to go; the call ends at 0 or at a terminal status."""
    aim: Scalar
    """Length of the next trial."""
    size: Scalar | None
    """The adaptive integrator's step where nothing cuts it short; None for fixed steps."""
    target: Integer
    """Kind of event that the next trial is aimed at."""
    breakaway: Scalar
    """Direction of sliding that has begun at velocity zero, else 0."""
    status: Integer
    switches: Integer
    slide_distance: Scalar
    work: Scalar
    positive_work: Scalar
    trials: Integer
    log: Events | None
    """The events so far, where they are recorded; their times are still to go."""


def mode_at(system: System, friction: Friction | None, walk: Walk, inertia: Coefficients) -> Scalar:
    """The mode that a step from here is taken in (eq. 32)."""
    if friction is None:
        return jnp.zeros_like(walk.phase)
    mode = mode_of(system.still(inertia, walk.crank_rate), walk.foot_velocity, friction.mu_static)
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
        log = Events(jnp.zeros(rows, dtype), jnp.zeros(rows, jnp.int32), jnp.zeros(rows, dtype))
    if isinstance(spec, EventExact):  # a first step that is seldom too long
        size = jnp.minimum(duration, 0.05 * spec.rtol**0.2)
        aim = within_turn(spec, size, rate)
    elif isinstance(spec, RK4Split):
        aim = duration / spec.substeps
    given = (state, system.drive, duration, system.scene.floor, model.total_mass, model.step_length)
    phase = value(state.phase)
    status = jnp.where(supports(phase), none, Status.NO_SOLUTION)
    walk = Walk(
        phase=phase,
        crank_rate=rate,
        foot_position=value(state.foot_position),
        foot_velocity=value(state.foot_velocity),
        steps=jnp.asarray(state.steps, jnp.int32),
        left=duration,
        aim=aim,
        size=size,
        status=jnp.where(pytrees.all_finite(given), status, Status.NON_FINITE).astype(jnp.int32),
        trials=none - 1,  # the blank trial before the first is settled, too
        log=log,
        **dict.fromkeys(("patch", "target", "switches"), none),
        **dict.fromkeys(("breakaway", "slide_distance", "work", "positive_work"), zero),
    )
    return on_its_patch(system, walk)


def on_its_patch(system: System, walk: Walk, where: Flag | bool = True) -> Walk:
    """The walk with its patch looked up by the foot's place on the floor, where `where`."""
    floor = system.scene.floor
    if not isinstance(floor, Patches):
        return walk
    steps = walk.steps.astype(walk.foot_position.dtype)
    place = steps * system.model.step_length + walk.foot_position
    found = patch_at(floor, place, walk.foot_velocity)
    return walk._replace(patch=jnp.where(where, found, walk.patch))


def within_turn(spec: EventExact, size: Scalar, rate: Scalar) -> Scalar:
    """A step no longer than `size` in which the crank turns by no more than allowed."""
    turn = jax.lax.stop_gradient(jnp.abs(rate) * size)
    return size * jnp.minimum(1.0, spec.max_turn / jnp.maximum(turn, spec.max_turn))


def bounds(dtype: DTypeLike) -> tuple[Scalar, Scalar]:
    """Ends of the support phase in the working precision."""
    return jnp.asarray(SUPPORT_START, dtype), jnp.asarray(SUPPORT_END, dtype)


def supports(phase: Scalar) -> Flag:
    """True if the leg carries the weight at this crank angle, or nearly."""
    low, high = bounds(phase.dtype)
    return (phase > low - PHASE_SLACK) & (phase < high + PHASE_SLACK)


def hand_over(system: System, walk: Walk, exchange: Flag, landed: Flag | None = None) -> Walk:
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


def note(walk: Walk, happens: Flag, kind: Integer | EventKind) -> Walk:
    """Count an event, and write it down where events are recorded."""
    kind = jnp.full_like(walk.status, kind)
    log = walk.log
    if log is not None:
        angle = walk.phase + jnp.pi * walk.steps.astype(walk.phase.dtype)
        place = jnp.minimum(walk.switches, log.times.shape[0] - 1)
        log = jax.tree.map(
            lambda row, new: row.at[place].set(
                jnp.where(happens, new.astype(row.dtype), row[place])
            ),
            log,
            Events(walk.left, kind, angle),
        )
    slips = happens & (kind == EventKind.SLIP)
    return walk._replace(
        switches=walk.switches + happens.astype(jnp.int32),
        status=jnp.where(slips, Status.SLIP_ONSET, walk.status).astype(jnp.int32),
        log=log,
    )
