"""PASIBOT: a planar biped with one motor, whose supporting foot sticks or slips."""

from stickslip.dynamics.biped.forces import (
    ForwardDynamics,
    InverseDynamics,
    forward_dynamics,
    inverse_dynamics,
)
from stickslip.dynamics.biped.inertia import (
    GroundMoment,
    ReducedInertia,
    ground_moment,
    reduced_inertia,
)
from stickslip.dynamics.biped.kinematics import (
    BODIES,
    SUPPORT_END,
    SUPPORT_START,
    Kinematics,
    LegPins,
    exchange_mismatch,
    kinematics,
    step_length,
)
from stickslip.dynamics.biped.model import BipedModel, prepare
from stickslip.dynamics.biped.params import LINKS, BipedParams
from stickslip.dynamics.biped.simulate import Trajectory, simulate, step
from stickslip.dynamics.biped.state import BipedState, Contact, Events, floor_position
from stickslip.dynamics.biped.table import Table
from stickslip.dynamics.biped.trial import RK4Split

__all__ = [
    "BODIES",
    "LINKS",
    "SUPPORT_END",
    "SUPPORT_START",
    "BipedModel",
    "BipedParams",
    "BipedState",
    "Contact",
    "Events",
    "ForwardDynamics",
    "GroundMoment",
    "InverseDynamics",
    "Kinematics",
    "LegPins",
    "RK4Split",
    "ReducedInertia",
    "Table",
    "Trajectory",
    "exchange_mismatch",
    "floor_position",
    "forward_dynamics",
    "ground_moment",
    "inverse_dynamics",
    "kinematics",
    "prepare",
    "reduced_inertia",
    "simulate",
    "step",
    "step_length",
]
