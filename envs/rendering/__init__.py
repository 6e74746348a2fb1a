"""Pictures, windows and animations. matplotlib, pygame and Pillow are imported at first use."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.envs.rendering.biped.frame import BipedFrame
    from stickslip.envs.rendering.biped.renderer import BipedRenderer
    from stickslip.envs.rendering.film.animation import save_animation
    from stickslip.envs.rendering.film.window import Window
    from stickslip.envs.rendering.ugv.frame import UGVFrame, WheelFrame
    from stickslip.envs.rendering.ugv.renderer import UGVRenderer
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "biped.frame": ("BipedFrame",),
            "biped.renderer": ("BipedRenderer",),
            "film.animation": ("save_animation",),
            "film.window": ("Window",),
            "ugv.frame": (
                "UGVFrame",
                "WheelFrame",
            ),
            "ugv.renderer": ("UGVRenderer",),
        },
    )

__all__ = [
    "BipedFrame",
    "BipedRenderer",
    "UGVFrame",
    "UGVRenderer",
    "WheelFrame",
    "Window",
    "save_animation",
]
