"""Functional environments as other libraries expect them; no physics in here."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.envs.adapters.brax import BraxEnv, fresh_episodes
    from stickslip.envs.adapters.gym import GymEnv
    from stickslip.envs.adapters.gymnax import GymnaxEnv
    from stickslip.envs.adapters.sb3 import SB3VecEnv
    from stickslip.envs.adapters.vector import GymVectorEnv
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "brax": ("BraxEnv", "fresh_episodes"),
            "gym": ("GymEnv",),
            "gymnax": ("GymnaxEnv",),
            "sb3": ("SB3VecEnv",),
            "vector": ("GymVectorEnv",),
        },
    )

__all__ = [
    "BraxEnv",
    "GymEnv",
    "GymVectorEnv",
    "GymnaxEnv",
    "SB3VecEnv",
    "fresh_episodes",
]
