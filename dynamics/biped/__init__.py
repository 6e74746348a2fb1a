"""PASIBOT: a planar biped with one motor, whose supporting foot sticks or slips."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.dynamics.biped.bodies.newton_euler import (
        NewtonEuler,
        condition_number,
        newton_euler,
    )
    from stickslip.dynamics.biped.coefficients.inertia import (
        GroundMoment,
        ReducedInertia,
        ground_moment,
        reduced_inertia,
    )
    from stickslip.dynamics.biped.coefficients.series import Chebyshev
    from stickslip.dynamics.biped.coefficients.table import Table
    from stickslip.dynamics.biped.fidelity import FIDELITIES, Joint, Paper, Reduced
    from stickslip.dynamics.biped.forces import (
        ForwardDynamics,
        InverseDynamics,
        forward_dynamics,
        inverse_dynamics,
    )
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
    from stickslip.dynamics.biped.mechanism.joints import JOINT_FORCES
    from stickslip.dynamics.biped.model import BipedModel, prepare
    from stickslip.dynamics.biped.params import LINKS, BipedParams
    from stickslip.dynamics.biped.simulation import Trajectory, simulate, simulate_inverse, step
    from stickslip.dynamics.biped.state import BipedState, Contact, Events, floor_position
    from stickslip.dynamics.biped.stepping.integrators import (
        INTEGRATORS,
        RK4,
        Euler,
        EventExact,
        RK4Split,
        SemiImplicitEuler,
    )
    from stickslip.dynamics.biped.trade.setting import Setting, own_time
    from stickslip.dynamics.biped.trade.settings import PRESETS, Recommendation, recommend
    from stickslip.dynamics.biped.trade.walk_check import WalkCheck, check_walk
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "fidelity": ("FIDELITIES", "Joint", "Paper", "Reduced"),
            "forces": (
                "ForwardDynamics",
                "InverseDynamics",
                "forward_dynamics",
                "inverse_dynamics",
            ),
            "coefficients.inertia": (
                "GroundMoment",
                "ReducedInertia",
                "ground_moment",
                "reduced_inertia",
            ),
            "stepping.integrators": (
                "INTEGRATORS",
                "RK4",
                "Euler",
                "EventExact",
                "RK4Split",
                "SemiImplicitEuler",
            ),
            "mechanism.joints": ("JOINT_FORCES",),
            "links": (
                "BODIES",
                "SUPPORT_END",
                "SUPPORT_START",
                "Kinematics",
                "LegPins",
                "exchange_mismatch",
                "kinematics",
                "step_length",
            ),
            "model": ("BipedModel", "prepare"),
            "bodies.newton_euler": ("NewtonEuler", "condition_number", "newton_euler"),
            "params": ("LINKS", "BipedParams"),
            "coefficients.series": ("Chebyshev",),
            "trade.setting": ("Setting", "own_time"),
            "trade.settings": ("PRESETS", "Recommendation", "recommend"),
            "simulation": ("Trajectory", "simulate", "simulate_inverse", "step"),
            "state": ("BipedState", "Contact", "Events", "floor_position"),
            "coefficients.table": ("Table",),
            "trade.walk_check": ("WalkCheck", "check_walk"),
        },
    )

__all__ = [
    "BODIES",
    "FIDELITIES",
    "INTEGRATORS",
    "JOINT_FORCES",
    "LINKS",
    "PRESETS",
    "RK4",
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
    "NewtonEuler",
    "Paper",
    "RK4Split",
    "Recommendation",
    "Reduced",
    "ReducedInertia",
    "SemiImplicitEuler",
    "Setting",
    "Table",
    "Trajectory",
    "WalkCheck",
    "check_walk",
    "condition_number",
    "exchange_mismatch",
    "floor_position",
    "forward_dynamics",
    "ground_moment",
    "inverse_dynamics",
    "kinematics",
    "newton_euler",
    "own_time",
    "prepare",
    "recommend",
    "reduced_inertia",
    "simulate",
    "simulate_inverse",
    "step",
    "step_length",
]
