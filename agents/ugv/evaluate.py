"""Measures of the UGV's episodes, and the optimum to score them against."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.rollout import (
    TEST_SEEDS,
    first_state,
    play_unseen,
    without_resets,
)
from stickslip.agents.evaluation.table import (
    Column,
    Interval,
    Measures,
    fraction_interval,
    mean_interval,
    row_of_test,
)
from stickslip.agents.ugv.controllers import Optimum
from stickslip.agents.ugv.machine import EVALUATED
from stickslip.agents.ugv.task import training_task
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from jaxtyping import Array

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.agents.evaluation.table import Columns, Say
    from stickslip.agents.machine import TrainingTask
    from stickslip.agents.ugv.config import UGVTrainConfig
    from stickslip.agents.ugv.controllers import UGVPlayer
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState

Add: TypeAlias = "Callable[[UGVEpisodes], UGVEpisodes]"
ANGLES = 21
"""Angles of the optimiser's grid for the score during training."""
GRID = ("optimum", "score")
"""Columns of the optimum over the grid."""
NO_SCORE = 1e-6
"""An optimum nearer to zero than this has no ratio to it."""


class UGVEpisodes(NamedTuple):
    """Kept data of each episode; every entry an array [episodes]."""

    reward: Array | np.ndarray
    """Sum of rewards."""
    cost: Array | np.ndarray
    """The criterion, in its unit."""
    optimum: Array | np.ndarray
    """The best over dp's grid on the same track; NaN where it was not asked for or has none. A
    drive off the grid may cost less."""
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


def _over(what: str) -> Callable[[UGVEpisodes], Interval]:
    """Mean of cost / what over the episodes that reached the end and have it."""

    def interval(played: UGVEpisodes) -> Interval:
        least = np.asarray(getattr(played, what), float)
        known = ~played.fell & np.isfinite(least) & (np.abs(least) > NO_SCORE)
        if not known.any():
            return Interval(np.nan, np.nan, np.nan)
        return mean_interval(np.asarray(played.cost[known] / least[known], float))

    return interval


def ugv_columns(unit: str) -> Columns[UGVEpisodes]:
    """The columns of a table; unit: the criterion's."""
    return {
        "return": (Column("return", "-", 1), lambda played: mean_interval(played.reward)),
        "cost": (Column("cost", unit, 2), _whole("cost")),
        "optimum": (Column("best over grid", unit, 2), _whole("optimum")),
        "score": (Column("cost / best over grid", "-", 3), _over("optimum")),
        "wheel_energy": (Column("wheels", "J", 1), _whole("wheel_energy")),
        "total_energy": (Column("with legs", "J", 1), _whole("total_energy")),
        "demand": (Column("friction used", "-", 3), _whole("demand")),
        "failures": (
            Column("failures", "%", 0, percent=True),
            lambda played: fraction_interval(played.fell),
        ),
    }


def keep_of(played: Rollout[UGVEnvState], params: UGVEnvParams) -> UGVEpisodes:
    """Kept data of an episode; the optimum is not known."""
    state, info = jax.tree.map(lambda leaf: leaf[-1], (played.state, played.info))
    at = played.state.station
    use = [
        jnp.abs(force) / normal
        for force, normal in ((at.F_rear, at.N_rear), (at.F_front, at.N_front))
    ]
    return UGVEpisodes(
        reward=state.totals.reward,
        cost=state.cost,
        optimum=jnp.full_like(state.cost, jnp.nan),
        distance=info["episode_distance"],
        wheel_energy=state.totals.wheel_energy,
        total_energy=state.totals.total_energy,
        demand=jnp.max(jnp.maximum(*use)),
        status=info["status"],
    )


def measures(
    env: UGVEnv, *, task: bool = False
) -> Measures[UGVEnvState, UGVEnvParams, UGVEpisodes]:
    """Measures of an environment's episodes, the criterion in its unit.

    Unless they are of a named task, each episode's cost is compared with the best path over dp's
    grid; a policy off the grid may come out slightly below 1.
    """
    env, columns = without_resets(env), dict(ugv_columns(env.measure.unit))
    if task:
        for name in GRID:
            del columns[name]
        return Measures(keep_of, columns, None)

    def complete(track: str, params: UGVEnvParams, seeds: Sequence[int], say: Say) -> Add:
        say(f"dynamic programming on {track}")
        found = optima(env, params, seeds, Optimum())
        return lambda played: played._replace(optimum=found)

    return Measures(keep_of, columns, complete)


def optima(env: UGVEnv, params: UGVEnvParams, seeds: Sequence[int], optimum: Optimum) -> np.ndarray:
    """The best over the grid of each seed's episode; NaN where there is no path."""
    found = [optimum.solve(env, params, first_state(env, params, seed)) for seed in seeds]
    return np.asarray([one.value if one.status.solved else np.nan for one in found])


def evaluate_policy(
    task: TrainingTask[UGVEnv, UGVEnvParams], policy: UGVPlayer, config: UGVTrainConfig
) -> dict[str, float]:
    """The reward in the criterion's unit over whole episodes on tracks never trained on, and the
    cost over the optimiser's on the same tracks: metrics by name."""
    columns = ugv_columns(task.env.measure.unit)
    played = play_unseen(task.env, policy, task.tested, config.evaluation_episodes, keep_of)
    played = played._replace(optimum=_optima_of(config, len(played.reward)))
    return row_of_test(columns, EVALUATED, played)


@lru_cache(maxsize=1)
def _optima_of(config: UGVTrainConfig, count: int) -> np.ndarray:
    """The optimiser's values on the test tracks, computed once."""
    task = training_task(config)
    seeds = range(TEST_SEEDS, TEST_SEEDS + count)
    return optima(without_resets(task.env), task.tested, seeds, Optimum(ANGLES))


def summary(ended: Mapping[str, np.ndarray], period: float) -> dict[str, float]:
    """Means over training episodes; of the cost, over those that reached the end."""
    failed = np.asarray(ended["status"] != Status.OK)

    def mean(name: str, rows: np.ndarray) -> float:
        values = np.asarray(ended["episode_" + name], float)[rows]
        return float(values.mean()) if len(values) else np.nan

    every = np.ones(len(failed), bool)
    return {
        "episodes": len(failed),
        "return": mean("return", every),
        "length": mean("length", every),
        **{name: mean(name, ~failed) for name in ("cost", "wheel_energy", "total_energy")},
        "failures": float(failed.mean()),
    }
