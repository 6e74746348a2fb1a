"""From a state of BipedEnv to what its renderer draws."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax.numpy as jnp

from stickslip.dynamics.biped import floor_position
from stickslip.dynamics.biped.floor import friction_on, patch_at
from stickslip.dynamics.scene import Grip
from stickslip.dynamics.status import Status
from stickslip.envs.biped.draw import drawn_scene
from stickslip.envs.rendering import BipedFrame

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.envs.biped.state import BipedEnvState


def biped_frame(
    state: BipedEnvState, info: Mapping[str, float], params: BipedEnvParams
) -> BipedFrame:
    """One unbatched state as plain numbers; `info` of the step that led to it, {} after a reset."""
    biped = state.biped
    place = floor_position(params.robot, biped)
    floor = drawn_scene(state.drawn, params).floor
    mu_static = mu_kinetic = None
    if not isinstance(floor, Grip):
        velocity = jnp.asarray(biped.foot_velocity)
        patch = patch_at(floor, place, velocity)
        mu_static, mu_kinetic = (float(mu) for mu in friction_on(floor, patch, velocity.dtype))
    status = Status(int(info.get("status", Status.OK)))
    return BipedFrame(
        phase=float(biped.phase),
        steps=int(biped.steps),
        floor_position=float(place),
        slide=float(biped.foot_position),
        crank_rate=float(biped.crank_rate),
        foot_velocity=float(biped.foot_velocity),
        time=float(biped.time),
        torque=float(info.get("torque", 0.0)),
        friction_force=float(info.get("friction_force", 0.0)),
        normal_force=float(info.get("normal_force", 0.0)),
        zmp=float(info.get("zmp", 0.0)),
        mu_static=mu_static,
        mu_kinetic=mu_kinetic,
        sticking=int(state.mode) == 0,
        mean_crank_rate=float(info.get("episode_mean_rate", biped.crank_rate)),
        commanded_rate=float(state.drawn.commanded_rate),
        status="ok" if not status.terminal else status.name.lower().replace("_", " "),
    )
