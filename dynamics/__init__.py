"""The two machines: kinematics, dynamics, friction and scenes. JAX only, pure functions."""

from stickslip.dynamics.scene import Grip, Patches, Scene, Uniform
from stickslip.dynamics.status import EventKind, Status

__all__ = ["EventKind", "Grip", "Patches", "Scene", "Status", "Uniform"]
