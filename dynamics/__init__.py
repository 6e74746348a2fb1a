"""The two machines: kinematics, dynamics, friction and scenes. JAX only, pure functions."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.dynamics.biped.recommendation import PRESETS as PRESETS
    from stickslip.dynamics.biped.recommendation import Recommendation as Recommendation
    from stickslip.dynamics.biped.recommendation import recommend as recommend
    from stickslip.dynamics.biped.settings import Setting as Setting
    from stickslip.dynamics.pytrees import register_pytree as register_pytree
    from stickslip.dynamics.scene import Grip as Grip
    from stickslip.dynamics.scene import Patches as Patches
    from stickslip.dynamics.scene import Scene as Scene
    from stickslip.dynamics.scene import Uniform as Uniform
    from stickslip.dynamics.status import EventKind as EventKind
    from stickslip.dynamics.status import Status as Status
else:
    __getattr__, __dir__, __all__ = loaded_when_used(__name__)
