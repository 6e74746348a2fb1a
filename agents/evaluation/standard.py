"""Measures of any environment's episodes, and evaluations during training."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.rollout import TEST_SEEDS, is_random, play, without_resets
from stickslip.agents.evaluation.table import (
    Column,
    Columns,
    Measures,
    fraction_interval,
    mean_interval,
    row_of_test,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jaxtyping import Array

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.agents.evaluation.table import AnyMeasures
    from stickslip.agents.protocol import AnyEnv, AnyPlayer, Timed


class StandardEpisodes(NamedTuple):
    """Kept data of each episode; every entry [episodes]."""

    reward: Array | np.ndarray
    """Sum of rewards."""
    duration: Array | np.ndarray
    """Control steps times control period [s]."""
    terminated: Array | np.ndarray
    """Ended otherwise than by the time limit."""

    @property
    def fell(self) -> np.ndarray:
        """Ended before its time."""
        return np.asarray(self.terminated)


def keep_of(played: Rollout[object], params: Timed) -> StandardEpisodes:
    """Kept data of an episode."""
    real = jnp.arange(len(played.reward)) < played.length
    return StandardEpisodes(
        reward=jnp.sum(jnp.where(real, played.reward, 0.0)),
        duration=played.length * params.control_period,
        terminated=played.terminated[-1],
    )


COLUMNS: Columns[StandardEpisodes] = {
    "return": (Column("return", "-", 2), lambda played: mean_interval(played.reward)),
    "duration": (Column("length", "s", 1), lambda played: mean_interval(played.duration)),
    "failures": (
        Column("failures", "%", 0, percent=True),
        lambda played: fraction_interval(played.fell),
    ),
}
MEASURES = Measures(keep_of, COLUMNS)


def evaluate_policy(
    env: AnyEnv,
    params: Timed,
    policy: AnyPlayer,
    episodes: int,
    measures: AnyMeasures,
    names: Sequence[str],
) -> dict[str, float]:
    """Metrics by name of a policy over whole episodes that training never sees; one where a reset
    draws nothing."""
    seeds = range(TEST_SEEDS, TEST_SEEDS + (episodes if is_random(params) else 1))
    played = play(without_resets(env), policy, params, seeds, measures.keep)
    return row_of_test(measures.columns, names, played)
