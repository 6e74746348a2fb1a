"""Functional environments as other libraries expect them; no physics in here."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.envs.adapters.checking import check_vector_env
    from stickslip.envs.adapters.gym import GymEnv
    from stickslip.envs.adapters.sb3 import SB3VecEnv
    from stickslip.envs.adapters.vector import GymVectorEnv
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "checking": ("check_vector_env",),
            "gym": ("GymEnv",),
            "sb3": ("SB3VecEnv",),
            "vector": ("GymVectorEnv",),
        },
    )

__all__ = [
    "GymEnv",
    "GymVectorEnv",
    "SB3VecEnv",
    "check_vector_env",
]
