"""Environment of a training configuration."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np

from stickslip.agents.biped.evaluate import MEASURES
from stickslip.agents.biped.scenes import scene_by_name
from stickslip.agents.biped.task import ANY_PHASE, from_anywhere
from stickslip.agents.evaluation.evaluate import TEST_SEEDS, play
from stickslip.agents.evaluation.table import row_of_test
from stickslip.dynamics.scene import Scene
from stickslip.dynamics.status import Status
from stickslip.envs.biped.env import BipedEnv
from stickslip.envs.biped.params import BipedEnvParams, Randomisation
from stickslip.envs.tasks.definition import task_by_name

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stickslip.agents.biped.config import TrainConfig
    from stickslip.agents.biped.controllers import BipedController
    from stickslip.agents.machine import TrainingTask

WEIGHTS = ("tracking_weight", "slip_weight", "energy_weight", "fall_penalty")
"""Of the reward, which a configuration may give otherwise for training."""


class Task(NamedTuple):
    """The environment and its parameters."""

    env: BipedEnv
    training: BipedEnvParams
    """Short episodes from anywhere, with the training reward."""
    moving: BipedEnvParams
    """Test: the standard reward and length, from any phase and up to the commanded rate."""
    rest: BipedEnvParams
    """Test: the standard reward and length, from rest."""

    @property
    def tested(self) -> BipedEnvParams:
        """Environment that a policy's file describes, without the start."""
        return self.rest


def make_task(config: TrainConfig) -> Task:
    """Build the task. ValueError for an unknown scene or numbers that do not go together.

    A named task is what it is: starts, length and reward of its episodes are those of all three,
    but for what the configuration says of training episodes.
    """
    if config.task is not None:
        env, params = task_by_name(config.task).make("same_step")
        return Task(cast("BipedEnv", env), training_of(config, params), params, params)
    env = BipedEnv(see_friction=config.see_friction, see_patch=config.see_patch)
    drawn = Randomisation(
        friction=config.random_friction,
        mass=config.random_mass,
        payload=config.random_payload,
        commanded_rate=config.random_commanded_rate,
    )
    standard = {"scene": make_scene(config), "commanded_rate": config.commanded_rate}
    rest = env.make_params(randomisation=drawn, **standard)
    return Task(env, training_of(config, rest), from_anywhere(rest), rest)


def training_of(config: TrainConfig, params: BipedEnvParams) -> BipedEnvParams:
    """The parameters of training episodes: those of a task but for what the configuration gives."""
    given = {name: getattr(config, name) for name in WEIGHTS} | {"time_limit": config.episode_time}
    changed = {name: one for name, one in given.items() if one is not None}
    if config.start_rate is not None:
        starts = {"phase": ANY_PHASE, "crank_rate": (0.0, config.start_rate)}
        changed["randomisation"] = replace(params.randomisation, **starts)
    return params.replace(**changed)


def make_scene(config: TrainConfig) -> Scene:
    """The named scene, or one floor of the friction given instead, with the payload."""
    scene = scene_by_name(config.scene)
    if config.mu_static is not None:
        scene = Scene.uniform(config.mu_static, config.mu_kinetic)
    return replace(scene, payload=config.payload).validate()


def evaluate_policy(
    task: TrainingTask[BipedEnv, BipedEnvParams],
    policy: BipedController,
    config: TrainConfig,
    names: Sequence[str],
) -> dict[str, float]:
    """The standard reward over whole episodes from anywhere, deterministic: metrics by name."""
    seeds = range(TEST_SEEDS, TEST_SEEDS + config.evaluation_episodes)
    env = replace(task.env, autoreset="disabled")
    played = play(env, policy, from_anywhere(task.tested), seeds, MEASURES.keep)
    return row_of_test(MEASURES.columns, names, played)


def summary(ended: Mapping[str, np.ndarray], period: float) -> dict[str, float]:
    """Means over training episodes and ratios of sums. See Machine."""
    names = ("return", "length", "walked", "slid", "energy", "mean_rate")
    total, length, walked, slid, energy, rate = (
        np.asarray(ended["episode_" + name], float) for name in names
    )
    fell = np.asarray(ended["status"] > Status.SLIP_ONSET, float)
    far = walked.sum() > 0.1
    return {
        "episodes": len(total),
        "return": total.mean(),
        "duration": length.mean() * period,
        "mean_crank_rate": np.average(rate, weights=length),
        "speed": walked.sum() / (length.sum() * period),
        "slip_per_metre": slid.sum() / walked.sum() if far else np.nan,
        "energy_per_metre": energy.sum() / walked.sum() if far else np.nan,
        "falls": fell.mean(),
    }
