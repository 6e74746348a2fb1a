"""UGV environment of a training configuration."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from stickslip.agents.evaluation.evaluate import TEST_SEEDS, play
from stickslip.agents.evaluation.table import row_of_test
from stickslip.agents.ugv.evaluate import optima, ugv_measures
from stickslip.agents.ugv.names import USUAL
from stickslip.agents.ugv.plans import Optimum
from stickslip.agents.ugv.tracks import ground_by_name
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import PoseSolver
from stickslip.envs.tasks.definition import task_by_name
from stickslip.envs.ugv.env import UGVEnv
from stickslip.envs.ugv.params import UGVEnvParams
from stickslip.envs.ugv.randomisation import UGVRandomisation

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stickslip.agents.machine import TrainingTask
    from stickslip.agents.ugv.config import UGVTrainConfig
    from stickslip.agents.ugv.names import UGVPlayer

GRID = 21
"""Angles of the optimiser's grid for the score during training."""
SOLVER = PoseSolver(iterations=5, samples=8)
"""Of training: unrolled, which suits batches; exact to rounding on such ground."""


class UGVTask(NamedTuple):
    """The environment and its parameters."""

    env: UGVEnv
    training: UGVEnvParams
    """With the training reward, and starts drawn if asked for."""
    test: UGVEnvParams
    """The reward in the criterion's unit, and the standard start."""

    @property
    def tested(self) -> UGVEnvParams:
        """Environment that a policy's file describes."""
        return self.test


def make_ugv_task(config: UGVTrainConfig) -> UGVTask:
    """Build the task. ValueError for an unknown ground or numbers that do not go together.

    A named task is what it is; but for a factor on all rewards of training episodes, and what the
    configuration says of their starts and of failing.
    """
    if config.task is not None:
        made, params = task_by_name(config.task).make("same_step")
        env = cast("UGVEnv", made)
        scale = config.reward_scale or 1 / USUAL[env.criterion]
        training = params.replace(reward_scale=scale)
        if config.failure is not None:
            training = training.replace(failure_penalty=config.failure / scale)
        if config.random_start is not None:
            drawn = replace(params.randomisation, start_angles=_radians(config.random_start))
            training = training.replace(randomisation=drawn)
        return UGVTask(env, training, params)
    env = UGVEnv(config.criterion, config.preview, SOLVER)
    ground = ground_by_name(config.tracks)
    start = np.radians(config.start_angle)
    common: dict[str, Any] = {
        "track": ground.track,
        "friction": config.friction,
        "leg_rate": config.leg_rate,
        "spacing": config.spacing,
        "start_angles": (start, start),
        "preview_length": config.preview_length,
        "preview_noise": config.preview_noise,
    }
    drawn = UGVRandomisation(ground.drawn, config.random_friction)
    test = env.make_params(randomisation=drawn, **common)
    scale = config.reward_scale or 1 / USUAL[config.criterion]
    if config.random_start is not None:
        drawn = replace(drawn, start_angles=_radians(config.random_start))
    training = env.make_params(
        randomisation=drawn,
        reward_scale=scale,
        failure_penalty=(config.failure or 0.0) / scale,
        **common,
    )
    return UGVTask(env, training, test)


def _radians(degrees: tuple[float, float]) -> tuple[float, float]:
    low, high = np.radians(degrees)
    return float(low), float(high)


def evaluate_policy(
    task: TrainingTask[UGVEnv, UGVEnvParams],
    policy: UGVPlayer,
    config: UGVTrainConfig,
    names: Sequence[str],
) -> dict[str, float]:
    """The reward in the criterion's unit over whole episodes on tracks never trained on, and the
    cost over the optimiser's on the same tracks: metrics by name."""
    env, measures = replace(task.env, autoreset="disabled"), ugv_measures(task.env)
    drawn = bool(task.tested.randomisation.track or task.tested.randomisation.friction)
    seeds = range(TEST_SEEDS, TEST_SEEDS + (config.evaluation_episodes if drawn else 1))
    played = play(env, policy, task.tested, seeds, measures.keep)
    played = played._replace(optimum=_optima(config, len(seeds)))
    return row_of_test(measures.columns, names, played)


@lru_cache(maxsize=1)
def _optima(config: UGVTrainConfig, count: int) -> np.ndarray:
    """The optimiser's values on the test tracks, computed once."""
    task = make_ugv_task(config)
    env = replace(task.env, autoreset="disabled")
    return optima(env, task.test, range(TEST_SEEDS, TEST_SEEDS + count), Optimum(GRID))


def summary(ended: Mapping[str, np.ndarray]) -> dict[str, float]:
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
