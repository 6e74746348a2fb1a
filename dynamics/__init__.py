"""The two machines: kinematics, dynamics, friction and scenes. JAX only, pure functions."""

from stickslip.dynamics.biped.setting import Setting
from stickslip.dynamics.biped.settings import PRESETS, Recommendation, recommend
from stickslip.dynamics.biped.walk_check import WalkCheck, check_walk
from stickslip.dynamics.scene import Grip, Patches, Scene, Smoothed, Uniform
from stickslip.dynamics.status import EventKind, Status

__all__ = [
    "PRESETS",
    "EventKind",
    "Grip",
    "Patches",
    "Recommendation",
    "Scene",
    "Setting",
    "Smoothed",
    "Status",
    "Uniform",
    "WalkCheck",
    "check_walk",
    "recommend",
]
