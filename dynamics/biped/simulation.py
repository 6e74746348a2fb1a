"""Stepping a walk through time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import eval_context

from stickslip.dynamics import checks, pytrees
from stickslip.dynamics.biped import settings
from stickslip.dynamics.biped.contact import CrankMotion, System, Torque, at_instant, torque_held
from stickslip.dynamics.biped.links import MISMATCH, exchange_mismatch
from stickslip.dynamics.biped.model import BipedModel, prepare
from stickslip.dynamics.biped.params import BipedParams
from stickslip.dynamics.biped.state import BipedState, Contact, Trajectory, start
from stickslip.dynamics.biped.stepping.euler import advance_euler
from stickslip.dynamics.biped.stepping.split import advance
from stickslip.dynamics.kernels.fused import fused
from stickslip.dynamics.scene import Grip, Scene, scene_of
from stickslip.dynamics.status import EventKind, Status

if TYPE_CHECKING:
    from jaxtyping import Array, Real

    from stickslip.dynamics.biped.contact import Drive


DONE_IN_A_STEP = ("switches", "slide_distance", "work", "positive_work")
"""The numbers of a Contact that add up over a walk."""
TIME_STEP = "a finite time step > 0 [s]"
FUNCTION = "accepted: a hashable function of the state, written in jax.numpy"


def step(
    params: BipedParams | BipedModel,
    scene: Scene | str,
    state: BipedState,
    torque: Real[pytrees.Number, ""],
    dt: Real[pytrees.Number, ""],
    *,
    fidelity: settings.Fidelity = "reduced",
    integrator: str | settings.Integrator = "rk4_split",
) -> tuple[BipedState, Contact]:
    """One time step of `dt` [s] under a constant motor torque [N m], friction switching included.

    Equations of MODEL 1.4 (eqs. 26-37); switching instants and exchanges of support are located
    inside the step and the step is split there (see RK4Split). Ends (lift-off, topple, no solution)
    are located likewise: the state is that of the end's instant, and its time says when. scene: a
    Scene, or a name (see Scene.named). Scalars: batch with vmap. Pass a model from `prepare` when
    stepping often: from bare parameters it is built again at every call. Works in the widest
    floating type among the arguments. A torque or a state that is not finite gives the status
    NON_FINITE, traced or not. Raises ValueError for dt <= 0 and unknown choices, before tracing.
    """
    checks.require_number("dt", dt, low=0.0, strict=True, accepted=TIME_STEP)
    pytrees.require_numeric(torque=torque, dt=dt)
    spec = settings.integrator_of(integrator)
    settings.require_fidelity(fidelity)
    scene = require_kinds(params, scene, state, torque=torque, dt=dt)
    state.require_support()
    drive = Torque(pytrees.as_float(torque))
    return _step(spec, fidelity, params, scene, state, drive, pytrees.as_float(dt))


def simulate(
    params: BipedParams | BipedModel,
    scene: Scene | str,
    state: BipedState,
    torque: pytrees.Numbers | Callable[[BipedState], pytrees.Number],
    duration: float,
    dt: float,
    *,
    fidelity: settings.Fidelity = "reduced",
    integrator: str | settings.Integrator = "rk4_split",
    max_power: pytrees.Number | None = None,
) -> Trajectory:
    """Walk for `duration` [s] in n equal steps of about `dt` [s] (n = duration / dt, rounded up).

    torque [N m]: a number, an array [n] with one value a step, or a function of the BipedState,
    asked at the beginning of every step and held during it. Other numbers that the function reads
    stay those of its first call; to vary them, pass `jax.tree_util.Partial(function, gain)`, asked
    as function(gain, state), or a callable registered pytree. max_power [W]: of the motor, which
    gives less torque where |torque x crank rate| would be more; the trajectory's `torques` are then
    the mean of each step, its work over the angle turned. The rest as in `step`. Raises ValueError
    also for a linkage that cannot hand over its support, when the scene is continuous.
    """
    if max_power is not None:
        accepted = "a finite power > 0 [W]"
        pytrees.require_one("max_power", max_power, low=0.0, strict=True, accepted=accepted)
    drive = Torque, max_power, torque
    return _walk(*drive, params, scene, state, duration, dt, fidelity, integrator)


def simulate_inverse(
    params: BipedParams | BipedModel,
    scene: Scene | str,
    state: BipedState,
    crank_acceleration: pytrees.Numbers | Callable[[BipedState], pytrees.Number],
    duration: float,
    dt: float,
    *,
    fidelity: settings.Fidelity = "reduced",
    integrator: str | settings.Integrator = "rk4_split",
) -> Trajectory:
    """Walk with a prescribed crank motion, the foot free to slip: eqs. (31)-(36), Fig. 16.

    crank_acceleration [rad/s^2]: 0 for the constant crank rate of `state`, or as the torque in
    `simulate` a number, an array [n] or a function of the state (other numbers that it reads are
    constants there, too), held during each step. The trajectory's `torques` are what the motor must
    give at the end of each step [N m]; its work is integrated along it. The rest as in `simulate`.
    """
    drive = CrankMotion, None, crank_acceleration
    return _walk(*drive, params, scene, state, duration, dt, fidelity, integrator)


def _walk(
    kind, max_power, values, params, scene, state, duration, dt, fidelity, integrator
) -> Trajectory:
    """`simulate` of either kind of drive: all is checked, then compiled."""
    given_dt, dt = dt, pytrees.require_one("dt", dt, low=0.0, strict=True, accepted=TIME_STEP)
    spec = settings.integrator_of(integrator)
    settings.require_fidelity(fidelity)
    accepted = "a finite time > 0 [s]"
    duration = pytrees.require_one("duration", duration, low=0.0, strict=True, accepted=accepted)
    scene = require_kinds(params, scene, state)
    state.validate()
    require_exchange(params, scene)
    numbers = 24 + (68 if scene.outputs == "joints" else 0)
    numbers += 3 * spec.log_size if spec.record_events else 0
    steps = duration / float(given_dt)
    checks.require_memory(f"dt = {checks.shown(given_dt)}", "steps", steps, 8 * numbers)
    count = max(1, int(np.ceil(duration / dt * (1 - 1e-9))))
    drive = _drive(kind._fields[0], values, count)
    given = params, scene, state, *drive, duration / count, max_power
    return _simulate(spec, fidelity, kind, count, *given)


def _drive(name: str, values: Any, count: int) -> tuple[Callable[..., Any] | None, Any]:
    """A function of the state, as a pytree whose numbers are traced, or the number for each of
    `count` steps; ValueError for what is neither."""
    if callable(values):
        if not jax.tree_util.all_leaves([values]):
            return values, None
        try:
            hash(values)
        except TypeError:
            raise ValueError(f"{name} = {checks.shown(values)}; {FUNCTION}") from None
        return jax.tree_util.Partial(values), None
    accepted = f"a finite number, a function of the state, or one for each of the {count} steps"
    checks.require_number(name, values, accepted=accepted)
    if np.ndim(values) > 0 and np.shape(values) != (count,):
        raise ValueError(f"{name} has shape {np.shape(values)}; accepted: {accepted}")
    return None, jnp.broadcast_to(jnp.asarray(values), (count,))


def stepped(
    spec: settings.Integrator,
    fidelity: settings.Fidelity,
    params: BipedParams | BipedModel,
    scene: Scene,
    state: BipedState,
    drive: Drive,
    dt: pytrees.Number,
    max_rate: pytrees.Number | None = None,
) -> tuple[BipedState, Contact]:
    """`step` without its checks, for use inside a trace. max_rate: see System."""
    model = prepare(params, fidelity=fidelity, payload=scene.payload)
    dtype = pytrees.float_type(model, scene, state, drive, dt)
    drive, duration = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), (drive, dt))
    duration = jnp.where(jnp.isinf(duration), duration, jnp.maximum(duration, 0.0))
    max_rate = None if max_rate is None else jnp.asarray(max_rate, dtype)
    system = System(model, scene, drive, duration, max_rate)
    walk = start(spec, system, state)
    if isinstance(spec, settings.Euler):
        walk = advance_euler(spec, system, walk)
    else:
        walk = advance(spec, system, walk)
    friction = system.friction(walk.patch)
    rate, slide, velocity = walk.crank_rate, walk.foot_position, walk.foot_velocity
    instant = at_instant(system, friction, walk.phase, rate, velocity, scene.outputs)
    log = walk.log
    over = walk.status > Status.SLIP_ONSET
    status = jnp.where(over, walk.status, jnp.maximum(instant.status, walk.status))
    begun = jnp.asarray(state.time, dtype)
    end = pytrees.clock(begun, duration)
    passed = jnp.where(jnp.isfinite(duration), duration - walk.left, 0.0)
    time = jnp.where(walk.left == 0, end, begun + passed)
    after = BipedState(walk.phase, walk.steps, rate, slide, velocity, time)
    of_end = ("friction_force", "normal_force", "zmp", "mode", "torque", "joint_forces")
    contact = Contact(
        **{name: getattr(instant, name) for name in of_end},
        **{name: getattr(walk, name) for name in DONE_IN_A_STEP},
        status=status,
        events=None if log is None else replace(log, times=end - log.times),
    )
    unmarked = (status <= Status.SLIP_ONSET) & ~pytrees.all_finite(after, contact)
    return after, replace(contact, status=jnp.where(unmarked, Status.NON_FINITE, status))


_step = jax.jit(fused(stepped, fixed=2), static_argnums=(0, 1))


@partial(jax.jit, static_argnums=(0, 1, 2, 3))
def _simulate(
    spec, fidelity, kind, count, params, scene, state, policy, values, size, max_power
) -> Trajectory:
    model = prepare(params, fidelity=fidelity, payload=scene.payload)
    scene = replace(scene, payload=None)  # the model carries it
    dtype = pytrees.float_type(model, scene, state, values)
    state = state.astype(dtype)
    begun = state.time
    state = replace(state, time=jnp.where(jnp.isfinite(begun), 0.0, begun))  # its clock counts
    limits = () if max_power is None else (jnp.asarray(max_power, dtype),)

    def body(carry, value):
        now, last = carry
        if policy is not None:
            try:
                value = policy(replace(now, time=begun + now.time))
            except jax.errors.JAXTypeError as error:
                given = checks.shown(getattr(policy, "func", policy))
                raise ValueError(f"{kind._fields[0]} = {given}; {FUNCTION}") from error
            if shape := jnp.shape(value):
                raise ValueError(f"the function of the state gave {shape}; accepted: a number")
        drive = kind(jnp.asarray(value, dtype), *limits)
        after, contact = _step(spec, fidelity, model, scene, now, drive, size)
        over = last.status > Status.SLIP_ONSET
        after, contact = jax.tree.map(
            lambda new, old: jnp.where(over, old, new), (after, contact), (now, _idle(last))
        )
        return (after, contact), (after, _torque_of(drive, now, after, contact), contact)

    idle = kind(jnp.zeros((), dtype), *limits)
    shapes = jax.eval_shape(lambda: _step(spec, fidelity, model, scene, state, idle, size)[1])
    blank = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), shapes)
    _, (states, torques, contacts) = jax.lax.scan(body, (state, blank), values, length=count)
    states = jax.tree.map(lambda one, rest: jnp.concatenate([one[None], rest]), state, states)
    states = replace(states, time=begun + states.time)
    if contacts.events is not None:
        times = begun + contacts.events.times
        contacts = replace(contacts, events=replace(contacts.events, times=times))
    return Trajectory(states, torques, contacts)


def _torque_of(drive: Drive, now: BipedState, after: BipedState, contact: Contact) -> Array:
    """What `Trajectory.torques` has of a step [N m]."""
    if (held := torque_held(drive)) is not None:
        return held
    if isinstance(drive, CrankMotion):
        return contact.torque
    fastest = jnp.maximum(jnp.abs(now.crank_rate), jnp.abs(after.crank_rate))
    turned = after.phase - now.phase + np.pi * (after.steps - now.steps)
    mean = jnp.where(turned == 0, contact.torque, contact.work / jnp.where(turned == 0, 1, turned))
    size = jnp.abs(drive.torque)
    limited = drive.at(fastest) != drive.torque
    return jnp.where(limited, jnp.clip(mean, -size, size), drive.torque)


def _idle(contact: Contact) -> Contact:
    """The contact as it stands, of a step in which nothing is done."""
    events = contact.events
    if events is not None:
        events = replace(events, kinds=jnp.full_like(events.kinds, EventKind.NONE))
    still = {name: jnp.zeros_like(getattr(contact, name)) for name in DONE_IN_A_STEP}
    return replace(contact, events=events, **still)


def require_kinds(params: Any, scene: object, state: Any, **numbers: pytrees.Number) -> Scene:
    """The scene, built where it is a name, or ValueError: for arguments of another kind, text and
    lists inside of them, a batch, and a foot that moves on a floor without slip."""
    accepted = "a BipedParams, or a BipedModel from `prepare`"
    checks.require_kind("params", params, (BipedParams, BipedModel), accepted)
    scene = scene_of(scene)
    checks.require_kind("state", state, BipedState, "a BipedState")
    if isinstance(params, BipedParams):
        pytrees.require_numeric(**vars(params))
    pytrees.require_numeric(**vars(state))
    scene.validate()
    crank = (params.params if isinstance(params, BipedModel) else params).crank
    for name, value in {**numbers, **vars(state), "params.crank": crank}.items():
        if isinstance(value, jax.Array):
            checks.require_precision(name, value.dtype)
        if shape := np.shape(value):
            raise ValueError(f"{name} has shape {shape}; accepted: one number (batch with vmap)")
    moves = checks.is_concrete(state) and np.any(np.asarray(state.foot_velocity) != 0)
    if moves and isinstance(scene.floor, Grip):
        given = checks.shown(state.foot_velocity)
        raise ValueError(f"foot_velocity = {given} on a grip floor; accepted: 0 [m/s]")
    return scene


def require_exchange(params: BipedParams | BipedModel, scene: Scene) -> None:
    """Raise ValueError if a linkage with an impact at the exchange is to walk on."""
    if isinstance(params, BipedModel) or scene.steps == "one" or not checks.is_concrete(params):
        return
    if np.ndim(params.crank) > 0:
        return  # a batch: Status.NO_EXCHANGE is said of each member
    with eval_context():  # a robot of plain numbers inside the caller's own jit
        mismatch = float(exchange_mismatch(params))
    if not mismatch < MISMATCH:
        raise ValueError(
            f"this linkage breaks the exchange of support: the other foot is off flat rest, or the "
            f"crank's centre off its axis, by {mismatch:.3g} (crank lengths or rad); "
            f'accepted: below {MISMATCH:.1g}, or a scene with steps="one"'
        )
