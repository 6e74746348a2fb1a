"""The compiled walks: one at a time with samples kept, and batches for their speed alone."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.tradeoff.scenes import ROWS, Walk
from stickslip.dynamics.biped import BipedModel, BipedParams, BipedState, prepare, step

if TYPE_CHECKING:
    from stickslip.dynamics.biped import Contact
    from stickslip.dynamics.biped.fidelity import Fidelity
    from stickslip.dynamics.biped.stepping.integrators import Integrator

EVENTS = 256
"""The most events of a walk that are kept."""


class Samples(NamedTuple):
    """A walk at the ends of its control periods, one row each; work and distance from the start."""

    phase: Any
    steps: Any
    crank_rate: Any
    foot_position: Any
    foot_velocity: Any
    friction_force: Any
    normal_force: Any
    mode: Any
    work: Any
    slide_distance: Any


class Rolled(NamedTuple):
    """What a walk came to."""

    samples: Samples
    status: Any
    switches: Any
    events: Any
    """Times, kinds and number, or None where they are not recorded."""


def model_of(fidelity: Fidelity, dtype: str) -> BipedModel:
    """The default robot in this fidelity and precision, ready for stepping."""
    params = BipedParams.from_bars(dtype=jnp.dtype(dtype))
    return jax.block_until_ready(jax.jit(partial(prepare, fidelity=fidelity))(params))


def table_bytes(model: BipedModel) -> int:
    """Memory of the inertia functions' coefficients."""
    return sum(np.asarray(leaf).nbytes for leaf in jax.tree.leaves(model.inertia))


def _control(law, state: BipedState):
    gain, wanted = law
    return gain * (wanted - state.crank_rate)


class _Forces(NamedTuple):
    """Of the ground at the end of a step."""

    friction_force: Any
    normal_force: Any
    mode: Any


class _Sums(NamedTuple):
    """From the walk's start on."""

    work: Any
    slide_distance: Any
    status: Any
    """The gravest."""
    switches: Any


def roll(integrator: Integrator, model, scene, law, state, dt, count, periods, stride) -> Rolled:
    """One walk of `periods` control periods, `count` steps of `dt` each; both counts traced.

    Compiled once for every step size and duration. Samples are those of every `stride`th period.
    """
    dtype = jnp.result_type(dt)
    zero, none = jnp.zeros((), dtype), jnp.zeros((), jnp.int32)
    whole = ("steps", "mode")
    rows = [jnp.zeros(ROWS, jnp.int32 if name in whole else dtype) for name in Samples._fields]
    log = None
    if integrator.record_events:
        log = (jnp.zeros(EVENTS, dtype), jnp.zeros(EVENTS, jnp.int32), none)

    def substep(torque, carry):
        state, _, sums, log = carry
        after, contact = step(model, scene, state, torque, dt, integrator=integrator)
        running = sums.status <= 1
        after = jax.tree.map(lambda new, old: jnp.where(running, new, old), after, state)
        if log is not None:
            log = _append(log, contact.events, running)
        forces = _Forces(contact.friction_force, contact.normal_force, contact.mode)
        return after, forces, _summed(sums, contact, running), log

    def period(index, carry):
        state, forces, sums, log, rows = carry
        again = partial(substep, _control(law, state))
        state, forces, sums, log = jax.lax.fori_loop(
            0, count, lambda _, now: again(now), (state, forces, sums, log)
        )
        row = _sample(state, forces, sums)
        place = jnp.where((index + 1) % stride == 0, (index + 1) // stride - 1, ROWS)
        rows = [
            column.at[place].set(value, mode="drop")
            for column, value in zip(rows, row, strict=True)
        ]
        return state, forces, sums, log, rows

    carry = (state, _Forces(zero, zero, none), _Sums(zero, zero, none, none), log, rows)
    _, _, sums, log, rows = jax.lax.fori_loop(0, periods, period, carry)
    return Rolled(Samples(*rows), sums.status, sums.switches, log)


def _summed(sums: _Sums, contact: Contact, running) -> _Sums:
    """With one more step, where it still runs."""
    return _Sums(
        sums.work + jnp.where(running, contact.work, 0.0),
        sums.slide_distance + jnp.where(running, contact.slide_distance, 0.0),
        jnp.maximum(sums.status, contact.status),
        sums.switches + jnp.where(running, contact.switches, 0),
    )


def _sample(state: BipedState, forces: _Forces, sums: _Sums) -> Samples:
    return Samples(
        state.phase,
        state.steps,
        state.crank_rate,
        state.foot_position,
        state.foot_velocity,
        forces.friction_force,
        forces.normal_force,
        forces.mode,
        sums.work,
        sums.slide_distance,
    )


def _append(log, events, running):
    times, kinds, count = log
    used = (events.kinds != 0) & running
    places = jnp.where(used, count + jnp.cumsum(used, dtype=count.dtype) - 1, EVENTS)
    return (
        times.at[places].set(events.times, mode="drop"),
        kinds.at[places].set(events.kinds, mode="drop"),
        count + jnp.sum(used, dtype=count.dtype),
    )


def roll_batch(integrator: Integrator, model, scene, law, states, dt, count, periods) -> Any:
    """A batch of walks, nothing kept but where they end and how."""

    def one(state, torque):
        after, contact = step(model, scene, state, torque, dt, integrator=integrator)
        return after, contact.status

    def substep(torques, carry):
        states, status = carry
        after, new = jax.vmap(one)(states, torques)
        running = status <= 1
        after = jax.tree.map(lambda a, b: jnp.where(running, a, b), after, states)
        return after, jnp.maximum(status, new)

    def period(_, carry):
        torques = _control(law, carry[0])
        return jax.lax.fori_loop(0, count, lambda _, now: substep(torques, now), carry)

    status = jnp.zeros(states.phase.shape, jnp.int32)
    return jax.lax.fori_loop(0, periods, period, (states, status))


def traced(dtype: str, dt: float, *counts: int) -> tuple:
    """Step size and counts as arrays, so that one program serves all of them."""
    return jnp.asarray(dt, dtype), *(jnp.asarray(count, jnp.int32) for count in counts)


def spread(walk: Walk, reference: Samples, batch: int, dtype: str) -> BipedState:
    """Initial states of a batch: the reference's own samples, crank rates apart by up to 1 %."""
    picked = np.arange(batch) % walk.samples
    nudge = 1 + 0.01 * np.random.default_rng(0).uniform(-1, 1, batch)

    def column(values):
        return jnp.asarray(np.asarray(values)[picked], dtype)

    return BipedState(
        phase=column(reference.phase),
        steps=jnp.asarray(np.asarray(reference.steps)[picked], jnp.int32),
        crank_rate=column(reference.crank_rate) * jnp.asarray(nudge, dtype),
        foot_position=column(reference.foot_position),
        foot_velocity=column(reference.foot_velocity),
        time=jnp.zeros(batch, dtype),
    )
