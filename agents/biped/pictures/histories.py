"""An episode's course as plain arrays, for plots."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import floor_position
from stickslip.dynamics.biped.floor import friction_on, patch_at
from stickslip.dynamics.scene import Grip
from stickslip.envs.biped.draw import drawn_robot, drawn_scene

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.dynamics.biped import BipedModel, BipedState
    from stickslip.dynamics.scene import Floor
    from stickslip.envs.biped.env import BipedEnvState
    from stickslip.envs.biped.params import BipedEnvParams


class Histories(NamedTuple):
    """At the end of every control step; every entry [steps] but the last two."""

    time: np.ndarray
    """[s]"""
    torque: np.ndarray
    """Held during the step [N m]."""
    crank_rate: np.ndarray
    """[rad/s]"""
    momentum: np.ndarray
    """P(theta) x crank rate [kg m/s]: horizontal momentum, but for a slide's."""
    friction_use: np.ndarray
    """|f| / (mu_static N) [-]; |f| / N on a floor without slip."""
    slid: np.ndarray
    """So far, either direction [m]."""
    sliding: np.ndarray
    """Whether the foot slid during the step."""
    commanded_rate: float | None
    """[rad/s]; None where nothing is commanded."""
    cruise: float | None
    """The momentum at the commanded mean speed, m x speed [kg m/s]."""


def histories(played: Rollout[BipedEnvState], params: BipedEnvParams) -> Histories:
    """The course of one episode (not a batch)."""
    played = played.trimmed()
    states, info = played.state, played.info
    momentum, mu_static = jax.vmap(lambda state: _place(state, params))(
        jax.tree.map(jnp.asarray, states)
    )
    robot = drawn_robot(played.start_state.drawn, params)
    commanded = float(played.start_state.drawn.commanded_rate)
    carried = np.asarray(mu_static) * np.maximum(info["normal_force"], 1e-6)
    return Histories(
        time=np.asarray(states.elapsed) * float(params.control_period),
        torque=np.asarray(info["torque"]),
        crank_rate=states.biped.crank_rate,
        momentum=np.asarray(momentum),
        friction_use=np.abs(info["friction_force"]) / np.maximum(carried, 1e-6),
        slid=np.asarray(info["episode_slid"]),
        sliding=np.asarray(info["slid"]) > 1e-7,
        commanded_rate=commanded,
        cruise=float(robot.total_mass * robot.step_length) * commanded / np.pi,
    )


def _place(state: BipedEnvState, params: BipedEnvParams):
    """P w and the static friction under the foot, 1 where there is no slip."""
    robot, floor = drawn_robot(state.drawn, params), drawn_scene(state.drawn, params).floor
    return place_on(robot, floor, state.biped)


def place_on(
    robot: BipedModel, floor: Floor, biped: BipedState
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """P w [kg m/s] and the static friction under the foot, 1 where there is no slip."""
    momentum = robot.inertia.at(biped.phase).P * biped.crank_rate
    if isinstance(floor, Grip):
        return momentum, jnp.ones_like(momentum)
    patch = patch_at(floor, floor_position(robot, biped), biped.foot_velocity)
    return momentum, friction_on(floor, patch, momentum.dtype).mu_static
