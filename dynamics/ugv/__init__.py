"""The UGV: a quasi-static half vehicle of a body, two legs and two driven wheels (MODEL 2).

Frames: world x forwards, y up; the body's frame has its origin at the rear hinge and x along the
body. Leg angles [rad]: 90 degrees is straight down, more is outwards. All functions take arrays of
any shape, and jit, vmap and differentiate.
"""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.dynamics.names import TRACKS as TRACKS
    from stickslip.dynamics.ugv.ground.surface import Surface as Surface
    from stickslip.dynamics.ugv.params import UGVParams as UGVParams
    from stickslip.dynamics.ugv.poses import Pose as Pose
    from stickslip.dynamics.ugv.poses import place as place
    from stickslip.dynamics.ugv.poses import pose as pose
    from stickslip.dynamics.ugv.poses import wheel_turns as wheel_turns
    from stickslip.dynamics.ugv.recommendation import Recommendation as Recommendation
    from stickslip.dynamics.ugv.recommendation import recommend as recommend
    from stickslip.dynamics.ugv.statics import Equilibrium as Equilibrium
    from stickslip.dynamics.ugv.statics import Forces as Forces
    from stickslip.dynamics.ugv.statics import SafeSplit as SafeSplit
    from stickslip.dynamics.ugv.statics import balance as balance
    from stickslip.dynamics.ugv.statics import equilibrium as equilibrium
    from stickslip.dynamics.ugv.statics import ground_forces as ground_forces
    from stickslip.dynamics.ugv.statics import leg_torques as leg_torques
    from stickslip.dynamics.ugv.statics import safe_split as safe_split
    from stickslip.dynamics.ugv.track import Odometer as Odometer
    from stickslip.dynamics.ugv.track import Track as Track
    from stickslip.dynamics.ugv.wheel import PoseSolver as PoseSolver
    from stickslip.dynamics.ugv.wheel import WheelContact as WheelContact
else:
    __getattr__, __dir__, __all__ = loaded_when_used(__name__)
