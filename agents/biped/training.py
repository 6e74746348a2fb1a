"""What a training configuration asks of the environment."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.biped.scenes import scene_by_name
from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START
from stickslip.dynamics.scene import Scene
from stickslip.envs.biped.env import BipedEnv
from stickslip.envs.biped.params import BipedEnvParams, Randomisation

if TYPE_CHECKING:
    from stickslip.agents.biped.config import TrainConfig

ANY_PHASE = (SUPPORT_START, SUPPORT_END)
TEST_SEEDS = 2**31
"""Evaluations during training use the seeds from here on, so that none is seen in training."""


class Task(NamedTuple):
    """The environment and its parameters."""

    env: BipedEnv
    training: BipedEnvParams
    """Short episodes from anywhere, with the training reward."""
    moving: BipedEnvParams
    """Test: the standard reward and length, from any phase and up to the commanded rate."""
    rest: BipedEnvParams
    """Test: the standard reward and length, from rest."""


def make_task(config: TrainConfig) -> Task:
    """Build the task. ValueError for an unknown scene or numbers that do not go together."""
    env = BipedEnv(see_friction=config.see_friction, see_patch=config.see_patch)
    drawn = Randomisation(
        friction=config.random_friction,
        mass=config.random_mass,
        payload=config.random_payload,
        commanded_rate=config.random_commanded_rate,
    )
    standard = {"scene": make_scene(config), "commanded_rate": config.commanded_rate}
    rest = env.make_params(randomisation=drawn, **standard)
    training = env.make_params(
        randomisation=replace(drawn, phase=ANY_PHASE, crank_rate=(0.0, config.start_rate)),
        time_limit=config.episode_time,
        slip_weight=config.slip_weight,
        energy_weight=config.energy_weight,
        fall_penalty=config.fall_penalty,
        **standard,
    )
    return Task(env, training, from_anywhere(rest), rest)


def make_scene(config: TrainConfig) -> Scene:
    """The named scene, or one floor of the friction given instead, with the payload."""
    scene = scene_by_name(config.scene)
    if config.mu_static is not None:
        scene = Scene.uniform(config.mu_static, config.mu_kinetic)
    return replace(scene, payload=config.payload).validate()


def from_anywhere(params: BipedEnvParams) -> BipedEnvParams:
    """The same task begun at any phase with a crank rate from 0 to the commanded one."""
    fastest = float(np.max(np.asarray(params.commanded_rate)))
    start = replace(params.randomisation, phase=ANY_PHASE, crank_rate=(0.0, fastest))
    return params.replace(randomisation=start)
