"""PASIBOT: a planar biped with one motor, whose supporting foot sticks or slips."""

from stickslip.dynamics.biped.contact import (
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
from stickslip.dynamics.biped.joints import JOINT_FORCES
from stickslip.dynamics.biped.links import (
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
from stickslip.dynamics.biped.params import BipedParams, own_time
from stickslip.dynamics.biped.recommendation import PRESETS, Recommendation, recommend
from stickslip.dynamics.biped.safety import SafeTorque, safe_torque
from stickslip.dynamics.biped.settings import (
    FIDELITIES,
    INTEGRATORS,
    Chebyshev,
    Euler,
    EventExact,
    Joint,
    Paper,
    Reduced,
    RK4Split,
    Setting,
    Table,
)
from stickslip.dynamics.biped.simulation import simulate, simulate_inverse, step
from stickslip.dynamics.biped.state import BipedState, Contact, Events, Trajectory, floor_position
from stickslip.dynamics.names import LINKS

__all__ = [
    "BODIES",
    "FIDELITIES",
    "INTEGRATORS",
    "JOINT_FORCES",
    "LINKS",
    "PRESETS",
    "SUPPORT_END",
    "SUPPORT_START",
    "BipedModel",
    "BipedParams",
    "BipedState",
    "Chebyshev",
    "Contact",
    "Euler",
    "EventExact",
    "Events",
    "ForwardDynamics",
    "GroundMoment",
    "InverseDynamics",
    "Joint",
    "Kinematics",
    "LegPins",
    "Paper",
    "RK4Split",
    "Recommendation",
    "Reduced",
    "ReducedInertia",
    "SafeTorque",
    "Setting",
    "Table",
    "Trajectory",
    "exchange_mismatch",
    "floor_position",
    "forward_dynamics",
    "ground_moment",
    "inverse_dynamics",
    "kinematics",
    "own_time",
    "prepare",
    "recommend",
    "reduced_inertia",
    "safe_torque",
    "simulate",
    "simulate_inverse",
    "step",
    "step_length",
]
