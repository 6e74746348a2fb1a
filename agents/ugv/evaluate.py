"""Measures of the UGV's episodes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.table import (
    Column,
    Columns,
    Interval,
    Measures,
    fraction_interval,
    mean_interval,
)
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState


class UGVEpisodes(NamedTuple):
    """Kept data of each episode; every entry an array [episodes]."""

    reward: Array | np.ndarray
    """Sum of rewards."""
    cost: Array | np.ndarray
    """The criterion, in its unit."""
    distance: Array | np.ndarray
    """Driven [m]."""
    wheel_energy: Array | np.ndarray
    """[J]"""
    total_energy: Array | np.ndarray
    """[J]"""
    demand: Array | np.ndarray
    """Greatest |F| / N of the stations after the first [-]."""
    status: Array | np.ndarray
    """Status of the last step."""

    @property
    def fell(self) -> np.ndarray:
        """Ended by a status outside the model (slip, rollover, grounding, ...)."""
        return np.asarray(self.status) != Status.OK


def _whole(of: str) -> Callable[[UGVEpisodes], Interval]:
    """Mean over the episodes that reached the end; NaN without any."""

    def interval(played: UGVEpisodes) -> Interval:
        values = np.asarray(getattr(played, of), float)[~played.fell]
        return mean_interval(values) if len(values) else Interval(np.nan, np.nan, np.nan)

    return interval


def ugv_columns(unit: str) -> Columns[UGVEpisodes]:
    """The columns of a table; unit: the criterion's."""
    return {
        "return": (Column("return", "-", 1), lambda played: mean_interval(played.reward)),
        "cost": (Column("cost", unit, 2), _whole("cost")),
        "wheel_energy": (Column("wheels", "J", 1), _whole("wheel_energy")),
        "total_energy": (Column("with legs", "J", 1), _whole("total_energy")),
        "demand": (Column("friction used", "-", 3), _whole("demand")),
        "failures": (
            Column("failures", "%", 0, percent=True),
            lambda played: fraction_interval(played.fell),
        ),
    }


def keep_of(played: Rollout[UGVEnvState], params: UGVEnvParams) -> UGVEpisodes:
    """Kept data of an episode."""
    state, info = jax.tree.map(lambda leaf: leaf[-1], (played.state, played.info))
    at = played.state.station
    use = [
        jnp.abs(force) / normal
        for force, normal in ((at.F_rear, at.N_rear), (at.F_front, at.N_front))
    ]
    return UGVEpisodes(
        reward=state.totals.reward,
        cost=state.cost,
        distance=info["episode_distance"],
        wheel_energy=state.totals.wheel_energy,
        total_energy=state.totals.total_energy,
        demand=jnp.max(jnp.maximum(*use)),
        status=info["status"],
    )


def measures(env: UGVEnv) -> Measures[UGVEnvState, UGVEnvParams, UGVEpisodes]:
    """Measures of an environment's episodes, the criterion in its unit."""
    return Measures(keep_of, ugv_columns(env.measure.unit))
