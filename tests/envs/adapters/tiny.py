"""A task that a few thousand steps of any learner show progress on: to hurry for 0.3 s.

An action of 0 earns 0.07, the best constant one, 0.3, earns 0.14.
"""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np

from stickslip.envs import BipedEnv, Randomisation

BIPED = "stickslip/Biped-v0"
IDLE, LEARNT = 0.072, 0.105
"""What doing nothing earns, and what only a policy that has learnt something does."""


def hurry() -> dict[str, Any]:
    """What gymnasium.make takes."""
    return {
        "scene": "firm",
        "mean_rate": 8.0,
        "fall_penalty": 0.0,
        "slip_weight": 0.0,
        "energy_weight": 0.0,
        "randomisation": Randomisation(phase=(pi / 2, 3 * pi / 2), crank_rate=(1.0, 2.0)),
        "time_limit": 0.3,
    }


def mean_return(act: Any, envs: Any, steps: int = 15) -> float:
    """Over the first episode of each environment of a Gymnasium vector; act: [n, 6] to [n, 1]."""
    obs, total = envs.reset(seed=100)[0], np.zeros(envs.num_envs)
    alive = np.ones(envs.num_envs, bool)
    for _ in range(steps):
        obs, reward, terminated, truncated, _ = envs.step(np.clip(act(obs), -1, 1))
        total += alive * reward
        alive &= ~(terminated | truncated)
    return float(total.mean())


def functional() -> tuple[BipedEnv, Any]:
    """The functional environment and its parameters."""
    env = BipedEnv(autoreset="same_step")
    return env, env.make_params(**hurry())
