"""The two machines: kinematics, dynamics, friction and scenes. JAX only, pure functions."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.dynamics.biped.recommendation import PRESETS, Recommendation, recommend
    from stickslip.dynamics.biped.settings import Setting
    from stickslip.dynamics.pytrees import register_pytree
    from stickslip.dynamics.scene import Grip, Patches, Scene, Uniform
    from stickslip.dynamics.status import EventKind, Status
else:
    __getattr__, __dir__ = loaded_when_used(__name__)

__all__ = [
    "PRESETS",
    "EventKind",
    "Grip",
    "Patches",
    "Recommendation",
    "Scene",
    "Setting",
    "Status",
    "Uniform",
    "recommend",
    "register_pytree",
]
