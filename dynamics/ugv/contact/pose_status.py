"""Status of a pose: whether the vehicle can stand where it was placed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp

from stickslip.dynamics.lanes import where_needed
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv.contact.wheel import WheelContact, penetration
from stickslip.dynamics.ugv.ground.hollow import nowhere_hollow
from stickslip.dynamics.ugv.ground.near import Near
from stickslip.dynamics.ugv.params import UGVParams
from stickslip.dynamics.ugv.pose_solver import PoseSolver, depth_allowed, size_near

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Int

    from stickslip.dynamics.ugv.contact.placed import Pose
    from stickslip.dynamics.ugv.ground.shapes import Values


def status_of(
    params: UGVParams, ground: Near, placed: Pose, missed: tuple[Values, Values], solver: PoseSolver
) -> Int[Array, "..."]:
    """The first of the pose's failures that applies."""
    dtype = placed.wheelbase.dtype
    eps = jnp.finfo(dtype).eps
    r = params.wheel_radius
    size = size_near(ground, placed.wheelbase, r)
    gap, rate = missed
    # At a sharp edge the last digit of x moves the wheel by far more than that.
    accepted = solver.accepted_gap(dtype) * size * jnp.maximum(jnp.abs(rate), 1)
    status = jnp.where(jnp.abs(gap) > accepted, Status.NOT_CONVERGED, Status.OK)
    hollow = (placed.rear.stretch <= 0) | (placed.front.stretch <= 0)
    if solver.samples:
        hollow |= _entered(ground, placed, r, size, solver.samples)
    status = jnp.where(hollow & (status == 0), Status.HOLLOW_GROUND, status)
    vanished = placed.wheelbase <= 16 * eps * params.body_length
    status = jnp.where(vanished, Status.NO_SOLUTION, status)
    numbers = placed.wheelbase + placed.pitch + placed.rear.x + sum(ground.anchor) + size
    return jnp.where(jnp.isfinite(numbers), status, Status.NON_FINITE).astype(jnp.int32)


def _entered(
    ground: Near, placed: Pose, radius: Values | float, size: Values, samples: int
) -> Bool[Array, "..."]:
    """True if the ground enters a wheel; looked up only where its own numbers leave it open."""

    def look(ground: Near, rear: WheelContact, front: WheelContact, radius: Values, size: Values):
        wheels = rear, front
        depth = jnp.maximum(*(penetration(ground, wheel, radius, samples) for wheel in wheels))
        return depth > depth_allowed(size)

    numbers = (ground, placed.rear, placed.front, jnp.asarray(radius, size.dtype), size)
    proved = nowhere_hollow(ground.shape, radius)
    if proved is None:
        return look(*numbers)
    never = jnp.zeros(jnp.shape(size), bool)
    return where_needed(~jnp.all(proved), look, jax.lax.stop_gradient(numbers), never)
