"""The two machines: kinematics, dynamics, friction and scenes. JAX only, pure functions."""

from stickslip.dynamics.biped.settings import PRESETS, Recommendation, Setting, recommend
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
    "recommend",
]
