"""Environments: pure functional cores and their Gymnasium and Stable-Baselines3 adapters."""

from stickslip.envs.biped import BipedEnv, BipedEnvState
from stickslip.envs.biped_params import BipedEnvParams, Randomisation
from stickslip.envs.checking import check_vector_env
from stickslip.envs.functional import FunctionalEnv
from stickslip.envs.gym import GymEnv
from stickslip.envs.vector import GymVectorEnv

__all__ = [
    "BipedEnv",
    "BipedEnvParams",
    "BipedEnvState",
    "FunctionalEnv",
    "GymEnv",
    "GymVectorEnv",
    "Randomisation",
    "check_vector_env",
]
