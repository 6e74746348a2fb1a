"""Pictures, windows and animations. matplotlib, pygame and Pillow are imported at first use."""

from stickslip.envs.rendering.animation import save_animation
from stickslip.envs.rendering.biped import BipedRenderer
from stickslip.envs.rendering.frame import BipedFrame
from stickslip.envs.rendering.ugv import UGVRenderer
from stickslip.envs.rendering.ugv_frame import UGVFrame, WheelFrame
from stickslip.envs.rendering.window import Window

__all__ = [
    "BipedFrame",
    "BipedRenderer",
    "UGVFrame",
    "UGVRenderer",
    "WheelFrame",
    "Window",
    "save_animation",
]
