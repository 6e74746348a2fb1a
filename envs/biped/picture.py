"""Conversion of BipedEnv's states into data for the renderer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import floor_position
from stickslip.dynamics.biped.contact import friction_on, patch_at
from stickslip.dynamics.scene import Grip
from stickslip.dynamics.status import Status
from stickslip.envs.biped.state import drawn_robot, drawn_scene
from stickslip.envs.rendering.biped import BipedFrame, slipping, stretches_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from jaxtyping import Array

    from stickslip.dynamics.biped import BipedModel, BipedState
    from stickslip.dynamics.scene import Floor
    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.envs.biped.state import BipedEnvState


def biped_frames(
    states: BipedEnvState, infos: Mapping[str, np.ndarray], params: BipedEnvParams
) -> BipedFrame:
    """The frame of states in a row, every leaf [n], with the info of the step that led to each."""
    place, (mu_static, mu_kinetic), floor, weight = jax.device_get(_seen(states, params))
    states = jax.device_get(states)
    biped = states.biped
    status = Status(int(infos["status"][-1]) if "status" in infos else Status.OK)
    forces = ("torque", "friction_force", "normal_force", "zmp")
    return BipedFrame(
        phase=np.asarray(biped.phase, float),
        floor=stretches_of(floor),
        weight=float(weight),
        steps=biped.steps,
        floor_position=np.asarray(place, float),
        slide=np.asarray(biped.foot_position, float),
        slid=np.asarray(states.totals.slid, float),
        crank_rate=np.asarray(biped.crank_rate, float),
        time=np.asarray(biped.time, float),
        **{name: np.asarray(infos.get(name, 0.0), float) for name in forces},
        mu_static=np.asarray(mu_static, float),
        mu_kinetic=np.asarray(mu_kinetic, float),
        slips=slipping(states.mode, infos.get("slid", 0.0)),
        walked=np.asarray(states.totals.walked, float),
        ended=status.words if status.terminal else "",
    )


@jax.jit
def _seen(states: BipedEnvState, params: BipedEnvParams):
    """Place and friction of the supporting foot [n], and the episode's floor and weight [N]."""
    drawn = jax.tree.map(lambda leaf: leaf[0], states.drawn)  # by a reset
    robot, floor = drawn_robot(drawn, params), drawn_scene(drawn, params).floor
    seen = jax.vmap(lambda state: under_foot(params.robot, floor, state.biped))(states)
    return *seen, floor, robot.total_mass * robot.gravity


def under_foot(
    robot: BipedModel, floor: Floor, state: BipedState
) -> tuple[Array, tuple[Array, Array]]:
    """Place of the supporting foot [m]; friction under it, NaN where it cannot slip."""
    place, velocity = floor_position(robot, state), jnp.asarray(state.foot_velocity)
    if isinstance(floor, Grip):
        none = jnp.full_like(place, jnp.nan)
        return place, (none, none)
    return place, friction_on(floor, patch_at(floor, place, velocity), velocity.dtype)
