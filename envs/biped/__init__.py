"""The biped's environment: what is stepped, observed, rewarded, drawn at random and shown."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.envs.biped.env import BipedEnv
    from stickslip.envs.biped.params import BipedEnvParams, Randomisation
    from stickslip.envs.biped.state import BipedEnvState
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "env": ("BipedEnv",),
            "params": (
                "BipedEnvParams",
                "Randomisation",
            ),
            "state": ("BipedEnvState",),
        },
    )

__all__ = [
    "BipedEnv",
    "BipedEnvParams",
    "BipedEnvState",
    "Randomisation",
]
