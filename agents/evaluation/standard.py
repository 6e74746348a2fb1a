"""What is measured of any environment's episodes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.columns import Column
from stickslip.agents.evaluation.run import Measures, play
from stickslip.agents.evaluation.statistics import fraction_interval, mean_interval
from stickslip.agents.evaluation.table import Columns, row_of_test
from stickslip.agents.training.trainer import TEST_SEEDS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.agents.evaluation.rollout import Rollout


class StandardEpisodes(NamedTuple):
    """What is kept of each episode; every entry [episodes]."""

    reward: Any
    """Sum of rewards."""
    duration: Any
    """Control steps times control period [s]."""
    terminated: Any
    """Ended otherwise than by the time limit."""

    @property
    def fell(self) -> np.ndarray:
        """Ended before its time."""
        return np.asarray(self.terminated)


def keep_of(played: Rollout, params: Any) -> StandardEpisodes:
    """What is kept of an episode."""
    real = jnp.arange(len(played.reward)) < played.length
    return StandardEpisodes(
        reward=jnp.sum(jnp.where(real, played.reward, 0.0)),
        duration=played.length * params.control_period,
        terminated=played.terminated[-1],
    )


COLUMNS: Columns = {
    "return": (Column("return", "-", 2), lambda played: mean_interval(played.reward)),
    "duration": (Column("length", "s", 1), lambda played: mean_interval(played.duration)),
    "failures": (
        Column("failures", "%", 0, percent=True),
        lambda played: fraction_interval(played.fell),
    ),
}
MEASURES = Measures(keep_of, COLUMNS)


def evaluate_policy(task: Any, policy: Any, episodes: int, names: Sequence[str]) -> Any:
    """Metrics by name of a policy on a training task, over episodes that training never sees."""
    seeds = range(TEST_SEEDS, TEST_SEEDS + episodes)
    env = replace(task.env, autoreset="disabled")
    return row_of_test(COLUMNS, names, play(env, policy, task.tested, seeds, keep_of))
