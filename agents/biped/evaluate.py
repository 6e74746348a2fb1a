"""Measures of the biped's episodes."""

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
from stickslip.dynamics.status import Status
from stickslip.envs.biped.state import BipedEnvState, drawn_robot

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.envs.biped.params import BipedEnvParams

MIN_DISTANCE = 0.1
"""Mean distance per episode below which nothing is said per metre (NaN) [m]."""


class Episodes(NamedTuple):
    """Kept data of each episode; every entry [episodes]."""

    reward: Array | np.ndarray
    """Sum of rewards."""
    duration: Array | np.ndarray
    """Control steps times control period [s]."""
    turned: Array | np.ndarray
    """Crank angle [rad]."""
    walked: Array | np.ndarray
    """Way of the hip, forwards positive [m]."""
    slid: Array | np.ndarray
    """Way of the feet over the floor, either direction [m]."""
    energy: Array | np.ndarray
    """Positive motor work and copper loss [J]."""
    weight: Array | np.ndarray
    """[N]"""
    status: Array | np.ndarray
    """Status of the last step."""

    @property
    def fell(self) -> Array | np.ndarray:
        """Ended by a status outside the model (topple, lift-off, runaway, ...)."""
        return (self.status > Status.SLIP_ONSET) & (self.status != Status.STEP_COMPLETE)


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


def keep_of(played: Rollout[BipedEnvState], params: BipedEnvParams) -> Episodes:
    """Kept data of an episode."""
    last = jax.tree.map(lambda leaf: leaf[-1], played.state)
    robot = drawn_robot(last.drawn, params)
    totals = last.totals
    return Episodes(
        reward=totals.reward,
        duration=last.elapsed * jnp.asarray(params.control_period, totals.reward.dtype),
        turned=totals.turned,
        walked=totals.walked,
        slid=totals.slid,
        energy=totals.energy,
        weight=robot.total_mass * robot.gravity,
        status=played.info["status"][-1],
    )


MEASURES = Measures(keep_of, COLUMNS)
