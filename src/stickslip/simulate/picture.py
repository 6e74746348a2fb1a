"""A walk over time, in the panels of `stickslip view --plot`. Needs the extra `viz`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.biped.pictures import LEAST_SLID, Course, momentum_of
from stickslip.agents.pictures.plots import plot_panels
from stickslip.dynamics.biped.settings import precision
from stickslip.dynamics.compilation import run_once
from stickslip.dynamics.scene import Smoothed
from stickslip.envs.biped.picture import under_foot

if TYPE_CHECKING:
    from pathlib import Path

    from jaxtyping import Array, Float

    from stickslip.dynamics import Scene
    from stickslip.dynamics.biped import BipedModel, BipedState
    from stickslip.dynamics.scene import Floor
    from stickslip.simulate.walk import Walk


@run_once
def _along(
    robot: BipedModel, floor: Floor, states: BipedState
) -> tuple[Float[Array, " n"], Float[Array, " n"] | None]:
    """Momentum and static friction under the foot, None where it cannot slip."""
    friction = jax.vmap(lambda state: under_foot(robot, floor, state)[1][0])(states)
    return momentum_of(robot, states), friction


def plot_walk(walk: Walk, scene: Scene, path: Path, title: str) -> Path:
    """Plot torque, crank rate, P w, friction used and distance slid; return the path."""
    states = jax.tree.map(lambda leaf: leaf[1:], walk.trajectory.states)
    contacts = walk.trajectory.contacts
    with precision(walk.dtype):
        floor = jax.tree.map(lambda leaf: jnp.asarray(leaf, walk.dtype), scene.floor)
        if isinstance(floor, Smoothed):
            raise ValueError("a smoothed floor has no static friction; accepted: a dry one")
        momentum, mu = _along(walk.robot, floor, jax.tree.map(jnp.asarray, states))
    time = np.asarray(states.time)
    course = Course(
        torque=np.asarray(walk.trajectory.torques),
        rate=np.asarray(states.crank_rate),
        momentum=np.asarray(momentum),
        friction=np.asarray(contacts.friction_force),
        normal=np.asarray(contacts.normal_force),
        mu_static=np.full(len(time), np.nan) if mu is None else np.asarray(mu),
        slide=np.asarray(states.foot_position),
        slid=np.cumsum(contacts.slide_distance, dtype=np.float64),
    )
    slips = np.asarray(contacts.slide_distance) > LEAST_SLID
    return plot_panels(course.panels(), time, "time [s]", path, title, slips)
