"""Environments: pure functional cores and their Gymnasium and Stable-Baselines3 adapters."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.envs.biped import BipedEnv, BipedEnvState
    from stickslip.envs.biped_params import BipedEnvParams, Randomisation
    from stickslip.envs.checking import check_vector_env
    from stickslip.envs.functional import FunctionalEnv
    from stickslip.envs.gym import GymEnv
    from stickslip.envs.ugv import UGVEnv
    from stickslip.envs.ugv_params import UGVEnvParams
    from stickslip.envs.ugv_randomisation import RandomTrack, UGVRandomisation
    from stickslip.envs.ugv_state import UGVEnvState
    from stickslip.envs.vector import GymVectorEnv
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "biped": ("BipedEnv", "BipedEnvState"),
            "biped_params": ("BipedEnvParams", "Randomisation"),
            "checking": ("check_vector_env",),
            "functional": ("FunctionalEnv",),
            "gym": ("GymEnv",),
            "ugv": ("UGVEnv",),
            "ugv_randomisation": ("RandomTrack", "UGVRandomisation"),
            "ugv_params": ("UGVEnvParams",),
            "ugv_state": ("UGVEnvState",),
            "vector": ("GymVectorEnv",),
        },
    )

__all__ = [
    "BipedEnv",
    "BipedEnvParams",
    "BipedEnvState",
    "FunctionalEnv",
    "GymEnv",
    "GymVectorEnv",
    "RandomTrack",
    "Randomisation",
    "UGVEnv",
    "UGVEnvParams",
    "UGVEnvState",
    "UGVRandomisation",
    "check_vector_env",
]
