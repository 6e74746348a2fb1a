"""Names of the UGV that the command line knows, and of what its runs leave."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from stickslip.dynamics.plain_checks import require_choice

if TYPE_CHECKING:
    from stickslip.agents.protocol import Player
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState

UGVPlayer: TypeAlias = "Player[UGVEnvState, UGVEnvParams]"
UGV_BASELINES = ("fixed-posture", "level-body", "receding-horizon", "optimum")
USUAL = {
    "wheel_energy": 300.0,
    "total_energy": 300.0,
    "peak_torque": 50.0,
    "torque_variation": 1e4,
    "grip": 1000.0,
    "normal_force": 1000.0,
    "friction_demand": 0.1,
}
"""About what a drive over the default bump costs, in the criterion's unit."""
FILM, FRAMES = "drive.gif", 10.0
"""The animation of a finished run, and its pictures a second, at most one a step."""


def ugv_baseline(name: str, env: UGVEnv) -> UGVPlayer:
    """A baseline or planner for an environment. ValueError for an unknown name."""
    from stickslip.agents.ugv.controllers import FixedPosture, LevelBody
    from stickslip.agents.ugv.plans import Optimum, RecedingHorizon

    known = {
        "fixed-posture": lambda: FixedPosture(env),
        "level-body": LevelBody,
        "receding-horizon": RecedingHorizon,
        "optimum": Optimum,
    }
    require_choice("baseline", name, UGV_BASELINES)
    return known[name]()


AXES = {
    "friction": "between wheels and ground",
    "height, centre, width": "of the ground that is driven over, here a bump [m]",
    "leg_rate": "[rad/m]",
    "spacing": "way of a step [m]",
    "preview_length": "how far the ground is seen [m]",
    "body_mass, wheel_radius": "and any other number of the vehicle",
    "randomisation.track.bump_height.1": "an end of a range that a reset draws from",
}
"""For the help of a sweep."""
