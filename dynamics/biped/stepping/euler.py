"""The paper's Euler scheme: fixed steps, in the mode that holds at their start; see Euler."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp

from stickslip.dynamics.biped.settings import Euler
from stickslip.dynamics.biped.state import Walk, bounds, hand_over, mode_at, note, on_its_patch
from stickslip.dynamics.biped.stepping.stages import ground_of, lever_at, status_at
from stickslip.dynamics.scene import Grip
from stickslip.dynamics.status import EventKind, Status

if TYPE_CHECKING:
    from stickslip.dynamics.biped.contact import Motion, System
    from stickslip.dynamics.pytrees import Flag, Integer, Scalar


def advance_euler(spec: Euler, system: System, walk: Walk) -> Walk:
    """Run a call to its end in `substeps` equal steps, with the same work always."""
    size = system.duration / spec.substeps

    def body(index: Integer, walk: Walk) -> Walk:
        running = walk.status <= Status.SLIP_ONSET
        walk, rest = _part(system, walk, size)
        walk, _ = _part(system, walk, rest)
        low, high = bounds(walk.phase.dtype)
        passed = running & ((walk.phase > high) | (walk.phase < low))
        walk = hand_over(system, note(walk, passed, EventKind.EXCHANGE), passed)
        left = system.duration - size * (index + 1).astype(size.dtype)
        last = index + 1 == spec.substeps
        running = walk.status <= Status.SLIP_ONSET
        left = jnp.where(running, jnp.where(last, 0.0, left), walk.left)
        return walk._replace(left=left.astype(size.dtype))

    return jax.lax.fori_loop(0, spec.substeps, body, walk)


def _part(system: System, walk: Walk, step: Scalar) -> tuple[Walk, Scalar]:
    """A step of length `step` up to a slide's stop; the walk there and the rest of the step."""
    friction = system.friction(walk.patch)
    inertia = system.model.inertia.at(walk.phase)
    mode = mode_at(system, friction, walk, inertia)
    first = system.motion(friction, mode, inertia, walk.crank_rate)
    reached = _uniformly_accelerated(walk, first, step)
    ground = ground_of(system, walk.crank_rate, first, lever_at(system, walk.phase))
    found = status_at(system, walk, first, ground, step, reached[:4])
    # A second part of no length and a walk that has ended change no status.
    judged = (step > 0) & (walk.status <= Status.SLIP_ONSET)
    found = jnp.where(judged, found, Status.OK)
    status = jnp.maximum(walk.status, found)
    runs = (status <= Status.SLIP_ONSET) & (step > 0)
    moved = note(walk, runs & (walk.foot_velocity == 0) & (mode != 0), EventKind.SLIP)
    rest, stops = jnp.zeros_like(step), jnp.zeros_like(runs)
    if not isinstance(system.scene.floor, Grip):
        reached, rest, stops = _stopped(walk, first, mode, reached, step)
    work = first.torque * (reached.phase - walk.phase)
    moved = Walk(*reached[:4], *moved[4:])._replace(
        left=walk.left - (step - rest),
        slide_distance=walk.slide_distance + jnp.abs(reached.foot_position - walk.foot_position),
        work=walk.work + work,
        positive_work=walk.positive_work + jnp.maximum(work, 0.0),
    )
    moved = on_its_patch(system, note(moved, runs & stops, EventKind.STICK))
    stays = walk._replace(status=status)
    return jax.tree.map(lambda new, old: jnp.where(runs, new, old), moved, stays), rest


def _stopped(
    walk: Walk, first: Motion, mode: Scalar, reached: Walk, step: Scalar
) -> tuple[Walk, Scalar, Flag]:
    """The step with its foot stopped where it would turn back; what is left; whether it stops."""
    slows = first.foot_acceleration * mode < 0
    until = -walk.foot_velocity / jnp.where(slows, first.foot_acceleration, 1.0)  # eq. (36)
    turned = (mode != 0) & (reached.foot_velocity * mode <= 0)
    stops = slows & (mode * walk.foot_velocity > 0) & (until < step)
    at_stop = _uniformly_accelerated(walk, first, jnp.where(stops, until, step))
    reached = jax.tree.map(lambda a, b: jnp.where(stops, a, b), at_stop, reached)
    rest = jnp.where(stops, step - until, jnp.zeros_like(step))
    stops = stops | turned
    return reached._replace(foot_velocity=jnp.where(stops, 0.0, reached.foot_velocity)), rest, stops


def _uniformly_accelerated(walk: Walk, first: Motion, step: Scalar) -> Walk:
    """Accelerations constant during the step: eqs. (27) and (35), for crank and foot alike."""
    alpha, foot = first.crank_acceleration, first.foot_acceleration
    theta = walk.phase + step * (walk.crank_rate + step / 2 * alpha)
    slide = walk.foot_position + step * (walk.foot_velocity + step / 2 * foot)
    rate, velocity = walk.crank_rate + step * alpha, walk.foot_velocity + step * foot
    return walk._replace(phase=theta, crank_rate=rate, foot_position=slide, foot_velocity=velocity)
