"""Pictures, windows and animations. matplotlib, pygame and Pillow are imported at first use."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.envs.rendering.animation import save_animation
    from stickslip.envs.rendering.biped import BipedFrame, BipedRenderer
    from stickslip.envs.rendering.ugv import UGVFrame, UGVRenderer
    from stickslip.envs.rendering.window import Window
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "animation": ("save_animation",),
            "biped": ("BipedFrame", "BipedRenderer"),
            "ugv": ("UGVFrame", "UGVRenderer"),
            "window": ("Window",),
        },
    )

__all__ = [
    "BipedFrame",
    "BipedRenderer",
    "UGVFrame",
    "UGVRenderer",
    "Window",
    "save_animation",
]
