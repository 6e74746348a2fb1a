"""The torque of a control period, moved to the nearest one without slip or fall."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax.numpy as jnp

from stickslip.dynamics.biped import floor_position
from stickslip.dynamics.biped.contact import Friction, friction_on, patch_at
from stickslip.dynamics.biped.safety import SafeTorque, nearest_safe
from stickslip.dynamics.scene import Grip

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.dynamics.biped import BipedModel, BipedState
    from stickslip.dynamics.scene import Floor, Scene
    from stickslip.envs.biped.params import BipedEnvParams

HOLDS = 10.0
"""Friction coefficient of a floor without slip: no start or stride needs more."""


def shielded(
    params: BipedEnvParams,
    robot: BipedModel,
    scene: Scene,
    state: BipedState,
    torque: Array,
    margin: float,
) -> SafeTorque:
    """`safe_torque` for one control period on the scene's own floor, the next foothold included.

    A torque that is no number stays one.
    """
    dtype = torque.dtype
    direction = jnp.where(state.crank_rate >= 0, 1.0, -1.0).astype(dtype)
    place = floor_position(robot, state)
    here = _friction(scene.floor, place, direction)
    ahead = _friction(scene.floor, place + direction * robot.step_length, direction)
    period, limit = (
        jnp.asarray(params.control_period, dtype),
        jnp.asarray(params.torque_limit, dtype),
    )
    kept = jnp.asarray(margin, dtype)
    safe = nearest_safe(robot, state, torque, kept, period, limit, here, ahead.mu_static)
    return safe._replace(torque=jnp.where(jnp.isfinite(torque), safe.torque, torque))


def _friction(floor: Floor, place: Array, direction: Array) -> Friction:
    """Coefficients of the patch at a place of the floor [m], on an edge of the one ahead."""
    dtype = place.dtype
    if isinstance(floor, Grip):
        return Friction(*[jnp.full((), HOLDS, dtype)] * 2)
    return friction_on(floor, patch_at(floor, place, direction), dtype)
