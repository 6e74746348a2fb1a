"""PASIBOT: a planar biped with one motor, whose supporting foot sticks or slips."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.dynamics.biped.contact import ForwardDynamics as ForwardDynamics
    from stickslip.dynamics.biped.contact import InverseDynamics as InverseDynamics
    from stickslip.dynamics.biped.contact import forward_dynamics as forward_dynamics
    from stickslip.dynamics.biped.contact import inverse_dynamics as inverse_dynamics
    from stickslip.dynamics.biped.inertia import GroundMoment as GroundMoment
    from stickslip.dynamics.biped.inertia import ReducedInertia as ReducedInertia
    from stickslip.dynamics.biped.inertia import ground_moment as ground_moment
    from stickslip.dynamics.biped.inertia import reduced_inertia as reduced_inertia
    from stickslip.dynamics.biped.joints import JOINT_FORCES as JOINT_FORCES
    from stickslip.dynamics.biped.links import BODIES as BODIES
    from stickslip.dynamics.biped.links import SUPPORT_END as SUPPORT_END
    from stickslip.dynamics.biped.links import SUPPORT_START as SUPPORT_START
    from stickslip.dynamics.biped.links import Kinematics as Kinematics
    from stickslip.dynamics.biped.links import LegPins as LegPins
    from stickslip.dynamics.biped.links import exchange_mismatch as exchange_mismatch
    from stickslip.dynamics.biped.links import kinematics as kinematics
    from stickslip.dynamics.biped.links import step_length as step_length
    from stickslip.dynamics.biped.model import BipedModel as BipedModel
    from stickslip.dynamics.biped.model import prepare as prepare
    from stickslip.dynamics.biped.params import BipedParams as BipedParams
    from stickslip.dynamics.biped.params import own_time as own_time
    from stickslip.dynamics.biped.recommendation import PRESETS as PRESETS
    from stickslip.dynamics.biped.recommendation import Recommendation as Recommendation
    from stickslip.dynamics.biped.recommendation import recommend as recommend
    from stickslip.dynamics.biped.safety import SafeTorque as SafeTorque
    from stickslip.dynamics.biped.safety import safe_torque as safe_torque
    from stickslip.dynamics.biped.settings import FIDELITIES as FIDELITIES
    from stickslip.dynamics.biped.settings import INTEGRATORS as INTEGRATORS
    from stickslip.dynamics.biped.settings import Chebyshev as Chebyshev
    from stickslip.dynamics.biped.settings import Euler as Euler
    from stickslip.dynamics.biped.settings import EventExact as EventExact
    from stickslip.dynamics.biped.settings import Joint as Joint
    from stickslip.dynamics.biped.settings import Paper as Paper
    from stickslip.dynamics.biped.settings import Reduced as Reduced
    from stickslip.dynamics.biped.settings import RK4Split as RK4Split
    from stickslip.dynamics.biped.settings import Setting as Setting
    from stickslip.dynamics.biped.settings import Table as Table
    from stickslip.dynamics.biped.simulation import simulate as simulate
    from stickslip.dynamics.biped.simulation import simulate_inverse as simulate_inverse
    from stickslip.dynamics.biped.simulation import step as step
    from stickslip.dynamics.biped.state import BipedState as BipedState
    from stickslip.dynamics.biped.state import Contact as Contact
    from stickslip.dynamics.biped.state import Events as Events
    from stickslip.dynamics.biped.state import Trajectory as Trajectory
    from stickslip.dynamics.biped.state import floor_position as floor_position
    from stickslip.dynamics.names import LINKS as LINKS
else:
    __getattr__, __dir__, __all__ = loaded_when_used(__name__)
