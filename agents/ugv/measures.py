"""What is measured of the UGV's episodes."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation import table
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState


class UGVEpisodes(NamedTuple):
    """Kept data of each episode; every entry an array [episodes].

    reward: sum. cost: the criterion, in its unit. distance: driven [m]. wheel_energy, total_energy
    [J]. demand: greatest |F| / N of the stations after the first [-]. status: of the last step.
    """

    reward: Array | np.ndarray
    cost: Array | np.ndarray
    distance: Array | np.ndarray
    wheel_energy: Array | np.ndarray
    total_energy: Array | np.ndarray
    demand: Array | np.ndarray
    status: Array | np.ndarray

    @property
    def fell(self) -> np.ndarray:
        """Ended by a status outside the model (slip, rollover, grounding, ...)."""
        return np.asarray(self.status) != Status.OK


def _whole(played: UGVEpisodes, of: str) -> table.Interval:
    """Mean over the episodes that reached the end; NaN without any."""
    values = np.asarray(getattr(played, of), float)[~played.fell]
    return table.mean_interval(values) if len(values) else table.Interval(np.nan)


def ugv_columns(unit: str) -> table.Columns[UGVEpisodes]:
    """The columns of a table; unit: the criterion's."""
    return {
        "return": (
            table.Column("return", "-", 1),
            lambda played: table.mean_interval(played.reward),
        ),
        "cost": (table.Column("cost", unit, 2), partial(_whole, of="cost")),
        "wheel_energy": (table.Column("wheels", "J", 1), partial(_whole, of="wheel_energy")),
        "total_energy": (table.Column("with legs", "J", 1), partial(_whole, of="total_energy")),
        "demand": (table.Column("friction used", "-", 3), partial(_whole, of="demand")),
        "failures": table.FAILURES,
    }


def keep_of(played: Rollout[UGVEnvState], params: UGVEnvParams) -> UGVEpisodes:
    """Kept data of an episode."""
    state, info = jax.tree.map(lambda leaf: leaf[-1], (played.state, played.info))
    use = [jnp.abs(force) / normal for force, normal, _ in played.state.station.wheels]
    return UGVEpisodes(
        **state.totals._asdict(),
        cost=state.cost,
        distance=info["episode_distance"],
        demand=jnp.max(jnp.maximum(*use)),
        status=info["status"],
    )


def measures(env: UGVEnv) -> table.Measures[UGVEnvState, UGVEnvParams, UGVEpisodes]:
    """See Machine; the criterion in its unit."""
    unit = env.measure.unit
    kept = {"reward": "-", "cost": unit, "distance": "m", "wheel_energy": "J", "total_energy": "J"}
    return table.Measures(keep_of, ugv_columns(unit), kept | {"demand": "-"})
