"""What is measured of the biped's episodes; training imports it, and no pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.table import (
    Column,
    Columns,
    Measures,
    fraction_interval,
    mean_interval,
    ratio_interval,
)
from stickslip.envs.biped.state import BipedEnvState, cost_of, drawn_robot, fell

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.envs.biped.env import BipedEnv
    from stickslip.envs.biped.params import BipedEnvParams

MIN_DISTANCE = 0.1
"""Mean distance per episode below which nothing is said per metre (NaN) [m]."""
KEPT = {
    "reward": "-",
    "duration": "s",
    "turned": "rad",
    "walked": "m",
    "slid": "m",
    "energy": "J",
    "weight": "N",
}
"""Units of what is kept of an episode."""


class Episodes(NamedTuple):
    """Kept data of each episode in the units of KEPT; every entry [episodes].

    reward: sum. duration: control steps times control period. turned: crank angle. walked: way of
    the centre of mass, forwards positive. slid: way of the feet over the floor, either direction.
    energy: positive motor work, and losses of copper and drive. status: of the last step.
    """

    reward: Array | np.ndarray
    duration: Array | np.ndarray
    turned: Array | np.ndarray
    walked: Array | np.ndarray
    slid: Array | np.ndarray
    energy: Array | np.ndarray
    weight: Array | np.ndarray
    status: Array | np.ndarray

    @property
    def fell(self) -> Array | np.ndarray:
        """Ended by a status outside the model (topple, lift-off, runaway, ...)."""
        return fell(jnp.asarray(self.status))

    @property
    def cost(self) -> Array | np.ndarray:
        """Sum of info["cost"] [m]."""
        return cost_of(jnp.asarray(self.slid), jnp.asarray(self.status))


COLUMNS: Columns[Episodes] = {
    "return": (Column("return", "-", 2), lambda e: mean_interval(e.reward)),
    "mean_speed": (Column("speed", "m/s", 3), lambda e: mean_interval(e.walked / e.duration)),
    "mean_crank_rate": (
        Column("crank rate", "rad/s", 2),
        lambda e: mean_interval(e.turned / e.duration),
    ),
    "slip_per_metre": (
        Column("slip", "m/m", 4),
        lambda e: ratio_interval(e.slid, e.walked, MIN_DISTANCE),
    ),
    "energy_per_metre": (
        Column("energy", "J/m", 1),
        lambda e: ratio_interval(e.energy, e.walked, MIN_DISTANCE),
    ),
    "cost_of_transport": (
        Column("transport", "-", 3),
        lambda e: ratio_interval(
            e.energy, e.weight * e.walked, MIN_DISTANCE * float(np.mean(e.weight))
        ),
    ),
    "falls": (Column("falls", "%", 0, percent=True), lambda e: fraction_interval(e.fell)),
    "duration": (Column("length", "s", 1), lambda e: mean_interval(e.duration)),
}


def keep_of(rollout: Rollout[BipedEnvState], params: BipedEnvParams) -> Episodes:
    """Kept data of an episode."""
    last = jax.tree.map(lambda leaf: leaf[-1], rollout.state)
    robot = drawn_robot(last.drawn, params)
    duration = last.elapsed * jnp.asarray(params.control_period, last.totals.reward.dtype)
    weight, status = robot.total_mass * robot.gravity, rollout.info["status"][-1]
    return Episodes(**last.totals._asdict(), duration=duration, weight=weight, status=status)


def measures(env: BipedEnv) -> Measures[BipedEnvState, BipedEnvParams, Episodes]:
    """See Machine; the same of every environment."""
    cost = Column("cost", "m", 3), lambda e: mean_interval(e.cost)
    return Measures(keep_of, COLUMNS, KEPT, cost)
