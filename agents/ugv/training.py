"""What a configuration asks of the UGV's environment."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stickslip.agents.ugv.tracks import ground_by_name
from stickslip.dynamics.ugv import PoseSolver
from stickslip.envs.ugv.env import UGVEnv
from stickslip.envs.ugv.params import UGVEnvParams
from stickslip.envs.ugv.randomisation import UGVRandomisation

if TYPE_CHECKING:
    from stickslip.agents.ugv.config import UGVTrainConfig

SOLVER = PoseSolver(iterations=5, samples=8)
"""Of training: unrolled, which suits batches; exact to rounding on such ground."""
USUAL = {
    "wheel_energy": 300.0,
    "total_energy": 300.0,
    "peak_torque": 50.0,
    "torque_variation": 1e4,
    "grip": 1000.0,
    "normal_force": 1000.0,
    "friction_demand": 0.1,
}
"""About what a drive over the default bump costs, in the criterion's unit."""


class UGVTask(NamedTuple):
    """The environment and its parameters."""

    env: UGVEnv
    training: UGVEnvParams
    """With the training reward, and starts drawn if asked for."""
    test: UGVEnvParams
    """The reward in the criterion's unit, and the standard start."""


def make_ugv_task(config: UGVTrainConfig) -> UGVTask:
    """Build the task. ValueError for an unknown ground or numbers that do not go together."""
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
        low, high = np.radians(config.random_start)
        drawn = UGVRandomisation(ground.drawn, config.random_friction, (float(low), float(high)))
    training = env.make_params(
        randomisation=drawn,
        reward_scale=scale,
        failure_penalty=config.failure / scale,
        **common,
    )
    return UGVTask(env, training, test)
