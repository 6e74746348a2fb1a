"""Environments: pure functional cores and their Gymnasium and Stable-Baselines3 adapters."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.envs.adapters.gym import GymEnv, GymVectorEnv
    from stickslip.envs.adapters.gymnax import GymnaxEnv
    from stickslip.envs.adapters.sb3 import SB3VecEnv
    from stickslip.envs.biped.env import BipedEnv
    from stickslip.envs.biped.params import BipedEnvParams, Randomisation
    from stickslip.envs.biped.state import BipedEnvState
    from stickslip.envs.collecting import Collected, collect
    from stickslip.envs.functional import FunctionalEnv
    from stickslip.envs.tasks.definition import TASKS, TaskDefinition, task_by_name
    from stickslip.envs.tasks.known import known_of
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.randomisation import RandomTrack, UGVRandomisation
    from stickslip.envs.ugv.state import UGVEnvState
else:
    __getattr__, __dir__ = loaded_when_used(__name__)

__all__ = [
    "TASKS",
    "BipedEnv",
    "BipedEnvParams",
    "BipedEnvState",
    "Collected",
    "FunctionalEnv",
    "GymEnv",
    "GymVectorEnv",
    "GymnaxEnv",
    "RandomTrack",
    "Randomisation",
    "SB3VecEnv",
    "TaskDefinition",
    "UGVEnv",
    "UGVEnvParams",
    "UGVEnvState",
    "UGVRandomisation",
    "collect",
    "known_of",
    "task_by_name",
]
