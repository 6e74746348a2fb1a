"""Conversion of BipedEnv's states into data for the renderer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp

from stickslip.dynamics.biped import floor_position
from stickslip.dynamics.biped.contact import friction_on, patch_at
from stickslip.dynamics.scene import Grip, Scene
from stickslip.dynamics.status import Status
from stickslip.envs.biped.state import drawn_robot, drawn_scene
from stickslip.envs.rendering import BipedFrame
from stickslip.envs.rendering.biped import patches_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from jaxtyping import Array

    from stickslip.dynamics.biped import BipedModel, BipedState
    from stickslip.dynamics.scene import Floor
    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.envs.biped.state import BipedEnvState
    from stickslip.envs.rendering.biped import Patch


def biped_frame(
    state: BipedEnvState, info: Mapping[str, float], params: BipedEnvParams
) -> BipedFrame:
    """One unbatched state as plain numbers; `info` of the step that led to it, {} after a reset."""
    place, friction, scenery = jax.device_get(_seen(state, params))
    return _frame(place, friction, jax.device_get(state), info, _own(scenery))


def biped_frames(
    states: BipedEnvState, infos: Mapping[str, np.ndarray], params: BipedEnvParams
) -> list[BipedFrame]:
    """The same of states in a row, every leaf [n], with the info of the step that led to each."""
    place, friction, scenery = jax.device_get(_seen_each(states, params))
    whole = place, friction, jax.device_get(states), dict(infos)
    own = _own(scenery)
    frames = []
    for i in range(len(place)):
        rows = jax.tree.map(lambda leaf, i=i: leaf[i], whole)
        frames.append(_frame(rows[0], rows[1], rows[2], rows[3], own))
    return frames


@jax.jit
def _seen(state: BipedEnvState, params: BipedEnvParams):
    """Values of `under_foot` and of `_scenery`."""
    scenery = _scenery(state, params)
    return *under_foot(params.robot, scenery[0], state.biped), scenery


@jax.jit
def _seen_each(states: BipedEnvState, params: BipedEnvParams):
    """The same of states in a row; their scenery once, since a reset draws it."""
    scenery = _scenery(jax.tree.map(lambda leaf: leaf[0], states), params)
    seen = jax.vmap(lambda state: under_foot(params.robot, scenery[0], state.biped))(states)
    return *seen, scenery


def _scenery(state: BipedEnvState, params: BipedEnvParams) -> tuple[Floor, Array]:
    """The episode's floor, and the weight of the robot in it [N]."""
    robot = drawn_robot(state.drawn, params)
    return drawn_scene(state.drawn, params).floor, robot.total_mass * robot.gravity


def under_foot(
    robot: BipedModel, floor: Floor, state: BipedState
) -> tuple[Array, tuple[Array | None, Array | None]]:
    """Place of the supporting foot [m]; friction under it, (None, None) where it cannot slip."""
    place = floor_position(robot, state)
    if isinstance(floor, Grip):
        return place, (None, None)
    velocity = jnp.asarray(state.foot_velocity)
    static, kinetic = friction_on(floor, patch_at(floor, place, velocity), velocity.dtype)
    return place, (static, kinetic)


def _own(scenery: tuple[Floor, np.ndarray]) -> tuple[tuple[Patch, ...], float]:
    """Patches of an episode's floor, and the weight."""
    floor, weight = scenery
    return tuple(patches_of(Scene(floor))), float(weight)


def _frame(
    place: np.ndarray,
    friction: tuple[np.ndarray | None, np.ndarray | None],
    state: BipedEnvState,
    info: Mapping[str, float],
    own: tuple[tuple[Patch, ...], float],
) -> BipedFrame:
    """Frame of a state, from NumPy arrays."""
    biped = state.biped
    mu_static, mu_kinetic = (None if mu is None else float(mu) for mu in friction)
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
        floor=own[0],
        weight=own[1],
        walked=float(state.totals.walked),
    )
