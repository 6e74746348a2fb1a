"""The UGV: a quasi-static half vehicle of a body, two legs and two driven wheels (MODEL 2).

Frames: world x forwards, y up; the body's frame has its origin at the rear hinge and x along the
body. Leg angles [rad]: 90 degrees is straight down, more is outwards. All functions take arrays of
any shape, and jit, vmap and differentiate.
"""

from stickslip.dynamics.names import TRACKS
from stickslip.dynamics.ugv.ground.surface import Surface
from stickslip.dynamics.ugv.params import UGVParams
from stickslip.dynamics.ugv.poses import Pose, place, pose, wheel_turns
from stickslip.dynamics.ugv.recommendation import Recommendation, recommend
from stickslip.dynamics.ugv.statics import (
    Equilibrium,
    Forces,
    SafeSplit,
    balance,
    equilibrium,
    ground_forces,
    leg_torques,
    safe_split,
)
from stickslip.dynamics.ugv.track import Odometer, Track
from stickslip.dynamics.ugv.wheel import PoseSolver, WheelContact

__all__ = [
    "TRACKS",
    "Equilibrium",
    "Forces",
    "Odometer",
    "Pose",
    "PoseSolver",
    "Recommendation",
    "SafeSplit",
    "Surface",
    "Track",
    "UGVParams",
    "WheelContact",
    "balance",
    "equilibrium",
    "ground_forces",
    "leg_torques",
    "place",
    "pose",
    "recommend",
    "safe_split",
    "wheel_turns",
]
