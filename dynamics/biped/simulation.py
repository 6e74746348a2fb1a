"""Stepping a walk through time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.drive import CrankMotion, Drive, System, Torque
from stickslip.dynamics.biped.fidelity import Fidelity, require_fidelity
from stickslip.dynamics.biped.floor import friction_on
from stickslip.dynamics.biped.forces import Instant, at_instant
from stickslip.dynamics.biped.model import BipedModel, prepare
from stickslip.dynamics.biped.params import BipedParams
from stickslip.dynamics.biped.state import BipedState, Contact, Events
from stickslip.dynamics.biped.stepping.boundary import (
    TIME_STEP,
    require_exchange,
    require_kinds,
    require_rest_on_grip,
    require_room,
    require_scalars,
)
from stickslip.dynamics.biped.stepping.integrate import advance
from stickslip.dynamics.biped.stepping.integrators import Integrator, Unsplit, integrator_of
from stickslip.dynamics.biped.stepping.unsplit import advance_unsplit
from stickslip.dynamics.biped.stepping.walk import Walk, entry_status, start
from stickslip.dynamics.checks import is_concrete, require_number
from stickslip.dynamics.kernels.fused import fused
from stickslip.dynamics.numeric import (
    Number,
    Numbers,
    all_finite,
    as_float,
    float_type,
    require_numeric,
    require_one,
)
from stickslip.dynamics.pytrees import register_pytree
from stickslip.dynamics.scene import Scene
from stickslip.dynamics.status import EventKind, Status
from stickslip.dynamics.sums import clock
from stickslip.dynamics.transfers import moves_numbers

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Array, Float, Int, Real


DONE_IN_A_STEP = ("switches", "slide_distance", "work", "positive_work")
"""The numbers of a Contact that add up over a walk."""


@register_pytree
@dataclass(frozen=True)
class Trajectory:
    """A walk in n steps: states [n + 1] with the initial one, torques and contacts [n].

    After a terminal status the last state and contact stand to the end, with nothing more done in
    the steps: work, positive_work, slide_distance and switches 0 and no events, so that sums are
    those of the walk.
    """

    states: BipedState
    torques: Float[Array, " n"]
    contacts: Contact

    @property
    def final(self) -> BipedState:
        """The last state."""
        return jax.tree.map(lambda leaf: leaf[-1], self.states)

    @property
    def status(self) -> Status | Int[Array, ""]:
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


def step(
    params: BipedParams | BipedModel,
    scene: Scene | str,
    state: BipedState,
    torque: Real[Number, ""],
    dt: Real[Number, ""],
    *,
    fidelity: Fidelity = "reduced",
    integrator: str | Integrator = "rk4_split",
) -> tuple[BipedState, Contact]:
    """One time step of `dt` [s] under a constant motor torque [N m], friction switching included.

    Equations of MODEL 1.4 (eqs. 26-37); switching instants and exchanges of support are located
    inside the step and the step is split there (see RK4Split). Ends (lift-off, topple, no solution)
    are located likewise: the state is that of the end's instant, and its time says when that was.
    scene: a Scene, or a name (see Scene.named). Scalars: batch with vmap. Pass a model from
    `prepare` when stepping often: from bare parameters it is built again at every call. Works in
    the widest floating type among the arguments. A torque or a state that is not finite gives the
    status NON_FINITE, traced or not. Raises ValueError for dt <= 0 and unknown choices, before
    tracing.
    """
    require_number("dt", dt, low=0.0, strict=True, accepted=TIME_STEP)
    require_numeric(torque=torque, dt=dt)
    spec = integrator_of(integrator)
    require_fidelity(fidelity)
    scene = require_kinds(params, scene, state)
    state.require_support()
    require_rest_on_grip(scene, state)
    require_scalars(params, torque=torque, dt=dt, **vars(state))
    return _step(spec, fidelity, params, scene, state, Torque(as_float(torque)), as_float(dt))


def simulate(
    params: BipedParams | BipedModel,
    scene: Scene | str,
    state: BipedState,
    torque: Numbers | Callable[[BipedState], Number],
    duration: float,
    dt: float,
    *,
    fidelity: Fidelity = "reduced",
    integrator: str | Integrator = "rk4_split",
) -> Trajectory:
    """Walk for `duration` [s] in n equal steps of about `dt` [s] (n = duration / dt, rounded up).

    torque [N m]: a number, an array [n] with one value a step, or a function of the BipedState,
    asked at the beginning of every step and held during it. The rest as in `step`. Raises
    ValueError also for a linkage that cannot hand over its support, when the scene is continuous.
    """
    return _walk(
        Torque, torque, params, scene, state, duration, dt, fidelity=fidelity, integrator=integrator
    )


def simulate_inverse(
    params: BipedParams | BipedModel,
    scene: Scene | str,
    state: BipedState,
    crank_acceleration: Numbers | Callable[[BipedState], Number],
    duration: float,
    dt: float,
    *,
    fidelity: Fidelity = "reduced",
    integrator: str | Integrator = "rk4_split",
) -> Trajectory:
    """Walk with a prescribed crank motion, the foot free to slip: eqs. (31)-(36), Fig. 16.

    crank_acceleration [rad/s^2]: 0 for the constant crank rate of `state`, or as the torque in
    `simulate` a number, an array [n] or a function of the state, held during each step. The
    trajectory's `torques` are what the motor must give at the end of each step [N m]; its work is
    integrated along the step. The rest as in `simulate`.
    """
    kind, values = CrankMotion, crank_acceleration
    return _walk(
        kind, values, params, scene, state, duration, dt, fidelity=fidelity, integrator=integrator
    )


@moves_numbers
def _walk(
    kind: type[Drive],
    values,
    params,
    scene,
    state: BipedState,
    duration,
    dt,
    *,
    fidelity,
    integrator,
) -> Trajectory:
    accepted = "a finite time > 0 [s]"
    duration = require_one("duration", duration, low=0.0, strict=True, accepted=accepted)
    given_dt, dt = dt, require_one("dt", dt, low=0.0, strict=True, accepted=TIME_STEP)
    spec = integrator_of(integrator)
    require_fidelity(fidelity)
    scene = require_kinds(params, scene, state)
    state.validate()
    require_scalars(params, **vars(state))
    require_room(duration, given_dt, scene, spec)
    require_rest_on_grip(scene, state)
    require_exchange(params, scene)
    count = max(1, int(np.ceil(duration / dt * (1 - 1e-9))))
    policy = values if callable(values) else None
    values = None if policy else _one_a_step(kind, values, count)
    size = duration / count
    return _simulate(spec, fidelity, policy, kind, count, params, scene, state, values, size)


def _one_a_step(kind: type[Drive], values: Any, count: int) -> Float[Array, " n"]:
    """The drive's number for each of `count` steps, or ValueError."""
    name = kind._fields[0]
    require_number(name, values, accepted="finite numbers, or a function of the state")
    if np.ndim(values) > 0 and np.shape(values) != (count,):
        raise ValueError(
            f"{name} has shape {np.shape(values)}; accepted: a number, a function of the state "
            f"or one value for each of the {count} steps"
        )
    return jnp.broadcast_to(jnp.asarray(values), (count,))


def stepped(
    spec: Integrator,
    fidelity: Fidelity,
    params: BipedParams | BipedModel,
    scene: Scene,
    state: BipedState,
    drive: Drive,
    dt: Number,
    max_rate: Number | None = None,
) -> tuple[BipedState, Contact]:
    """`step` without its checks, for use inside a trace. max_rate: see System."""
    model = prepare(params, fidelity=fidelity, payload=scene.payload)
    dtype = float_type(model, scene, state, drive, dt)
    drive, duration = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), (drive, dt))
    duration = jnp.where(jnp.isinf(duration), duration, jnp.maximum(duration, 0.0))
    max_rate = None if max_rate is None else jnp.asarray(max_rate, dtype)
    system = System(model, scene, drive, duration, max_rate)
    walk = start(model, scene, state, duration, spec, dtype)
    walk = walk._replace(status=entry_status(system, walk, state))
    if isinstance(spec, Unsplit):
        walk = advance_unsplit(spec, system, walk)
    else:
        walk = advance(spec, system, walk)
    instant = _contact(system, walk, scene.outputs)
    motion = instant.motion
    over = walk.status > Status.SLIP_ONSET
    status = jnp.where(over, walk.status, jnp.maximum(instant.status, walk.status))
    begun = jnp.asarray(state.time, dtype)
    end = clock(begun, duration)
    passed = jnp.where(jnp.isfinite(duration), duration - walk.left, 0.0)
    after = BipedState(
        phase=walk.theta,
        steps=walk.steps,
        crank_rate=walk.rate,
        foot_position=walk.slide,
        foot_velocity=walk.velocity,
        time=jnp.where(walk.left == 0, end, begun + passed),
    )
    contact = Contact(
        friction_force=motion.friction_force,
        normal_force=motion.normal_force,
        zmp=instant.zmp,
        mode=instant.mode.astype(jnp.int32),
        status=status,
        switches=walk.switches,
        slide_distance=walk.distance,
        torque=motion.torque,
        work=walk.work,
        positive_work=walk.positive_work,
        joint_forces=instant.joint_forces,
        events=_events(walk, end),
    )
    unmarked = (status <= Status.SLIP_ONSET) & ~all_finite(after, contact)
    return after, replace(contact, status=jnp.where(unmarked, Status.NON_FINITE, status))


_step = jax.jit(fused(stepped, fixed=2), static_argnums=(0, 1))


@partial(jax.jit, static_argnums=(0, 1, 2, 3, 4))
def _simulate(
    spec, fidelity, policy, kind: type[Drive], count, params, scene, state, values, size
) -> Trajectory:
    model = prepare(params, fidelity=fidelity, payload=scene.payload)
    scene = replace(scene, payload=None)  # the model carries it
    dtype = float_type(model, scene, state, values)
    state = state.astype(dtype)
    begun = state.time
    state = replace(state, time=jnp.where(jnp.isfinite(begun), 0.0, begun))  # its clock counts

    def body(carry, value):
        now, last = carry
        if policy is not None:
            value = policy(replace(now, time=begun + now.time))
        drive = kind(jnp.asarray(value, dtype))
        after, contact = _step(spec, fidelity, model, scene, now, drive, size)
        over = last.status > Status.SLIP_ONSET
        after, contact = jax.tree.map(
            lambda new, old: jnp.where(over, old, new), (after, contact), (now, _idle(last))
        )
        torque = drive.torque if isinstance(drive, Torque) else contact.torque
        return (after, contact), (after, torque, contact)

    blank_drive = kind(jnp.zeros((), dtype))
    shapes = jax.eval_shape(
        lambda: _step(spec, fidelity, model, scene, state, blank_drive, size)[1]
    )
    blank = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), shapes)
    _, (states, torques, contacts) = jax.lax.scan(body, (state, blank), values, length=count)
    states = jax.tree.map(lambda one, rest: jnp.concatenate([one[None], rest]), state, states)
    states = replace(states, time=begun + states.time)
    if contacts.events is not None:
        times = begun + contacts.events.times
        contacts = replace(contacts, events=replace(contacts.events, times=times))
    return Trajectory(states, torques, contacts)


def _contact(system: System, walk: Walk, outputs: str) -> Instant:
    """Forces and status of the state as it is."""
    friction = friction_on(system.scene.floor, walk.patch, walk.theta.dtype)
    return at_instant(system, friction, walk.theta, walk.rate, walk.velocity, outputs)


def _idle(contact: Contact) -> Contact:
    """The contact as it stands, of a step in which nothing is done."""
    events = contact.events
    if events is not None:
        events = replace(events, kinds=jnp.full_like(events.kinds, EventKind.NONE))
    still = {name: jnp.zeros_like(getattr(contact, name)) for name in DONE_IN_A_STEP}
    return replace(contact, events=events, **still)


def _events(walk: Walk, end) -> Events | None:
    if walk.log is None:
        return None
    return Events(end - walk.log.left, walk.log.kinds, walk.log.angles)
