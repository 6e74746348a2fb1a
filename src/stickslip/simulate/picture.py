"""A walk over time, in the panels of `stickslip view --plot`. Needs the extra `viz`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.biped.pictures.histories import Histories, place_on
from stickslip.agents.biped.pictures.plots import plot_course
from stickslip.dynamics.biped.trade.check_batch import precision
from stickslip.dynamics.once import run_once
from stickslip.dynamics.scene import Smoothed

if TYPE_CHECKING:
    from pathlib import Path

    from jaxtyping import Array, Float

    from stickslip.dynamics import Scene
    from stickslip.dynamics.biped import BipedModel, BipedState
    from stickslip.dynamics.scene import Floor
    from stickslip.simulate.walk import Walk


def plot_walk(walk: Walk, scene: Scene, path: Path, title: str) -> Path:
    """Torque, crank rate, P w, friction use and way slid; return the path."""
    return plot_course(course_of(walk, scene), scene.floor, path, title)


@run_once
def _places(
    robot: BipedModel, floor: Floor, states: BipedState
) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    return jax.vmap(lambda state: place_on(robot, floor, state))(states)


def course_of(walk: Walk, scene: Scene) -> Histories:
    """The walk as its episode would be."""
    states = jax.tree.map(lambda leaf: leaf[1:], walk.trajectory.states)
    contacts = walk.trajectory.contacts
    with precision(walk.dtype):
        floor = jax.tree.map(lambda leaf: jnp.asarray(leaf, walk.dtype), scene.floor)
        if isinstance(floor, Smoothed):
            raise ValueError("a smoothed floor has no static friction; accepted: a dry one")
        momentum, mu_static = _places(walk.robot, floor, jax.tree.map(jnp.asarray, states))
    carried = np.asarray(mu_static) * np.maximum(contacts.normal_force, 1e-6)
    return Histories(
        time=np.asarray(states.time),
        torque=np.asarray(walk.trajectory.torques),
        crank_rate=np.asarray(states.crank_rate),
        momentum=np.asarray(momentum),
        friction_use=np.abs(contacts.friction_force) / np.maximum(carried, 1e-6),
        slid=np.cumsum(contacts.slide_distance, dtype=np.float64),
        sliding=np.asarray(contacts.slide_distance) > 1e-7,
        commanded_rate=None,
        cruise=None,
    )
