"""The UGV's environment: what is stepped, observed, rewarded, drawn at random and shown."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.randomisation import RandomTrack, UGVRandomisation
    from stickslip.envs.ugv.state import UGVEnvState
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "env": ("UGVEnv",),
            "params": ("UGVEnvParams",),
            "randomisation": (
                "RandomTrack",
                "UGVRandomisation",
            ),
            "state": ("UGVEnvState",),
        },
    )

__all__ = [
    "RandomTrack",
    "UGVEnv",
    "UGVEnvParams",
    "UGVEnvState",
    "UGVRandomisation",
]
