"""The UGV: a quasi-static half vehicle of a body, two legs and two driven wheels (MODEL 2).

Frames: world x forwards, y up; the body's frame has its origin at the rear hinge and x along the
body. Leg angles [rad]: 90 degrees is straight down, more is outwards. All functions take arrays of
any shape, and jit, vmap and differentiate.
"""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.dynamics.ugv.names import TRACKS
    from stickslip.dynamics.ugv.odometer import Odometer, wheel_turns
    from stickslip.dynamics.ugv.params import UGVParams
    from stickslip.dynamics.ugv.pose_solver import PoseSolver
    from stickslip.dynamics.ugv.poses import Pose, place, pose
    from stickslip.dynamics.ugv.recommendation import (
        Recommendation,
        Setting,
        SettingCheck,
        check_poses,
        recommend,
    )
    from stickslip.dynamics.ugv.statics import (
        Equilibrium,
        Forces,
        balance,
        equilibrium,
        ground_forces,
        leg_torques,
    )
    from stickslip.dynamics.ugv.track import Surface, Track
    from stickslip.dynamics.ugv.wheel import WheelContact
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "statics": (
                "Equilibrium",
                "Forces",
                "balance",
                "equilibrium",
                "ground_forces",
                "leg_torques",
            ),
            "names": ("TRACKS",),
            "odometer": ("Odometer", "wheel_turns"),
            "params": ("UGVParams",),
            "poses": ("Pose", "place", "pose"),
            "pose_solver": ("PoseSolver",),
            "recommendation": (
                "Recommendation",
                "Setting",
                "SettingCheck",
                "check_poses",
                "recommend",
            ),
            "track": ("Surface", "Track"),
            "wheel": ("WheelContact",),
        },
    )

__all__ = [
    "TRACKS",
    "Equilibrium",
    "Forces",
    "Odometer",
    "Pose",
    "PoseSolver",
    "Recommendation",
    "Setting",
    "SettingCheck",
    "Surface",
    "Track",
    "UGVParams",
    "WheelContact",
    "balance",
    "check_poses",
    "equilibrium",
    "ground_forces",
    "leg_torques",
    "place",
    "pose",
    "recommend",
    "wheel_turns",
]
