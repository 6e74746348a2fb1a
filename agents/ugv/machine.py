"""The UGV as a machine. See stickslip.agents.machine.Machine."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from stickslip.agents.machine import Machine
from stickslip.agents.ugv.config import TRACK_NAMES, UGVTrainConfig
from stickslip.optim.posture import CRITERIA_IN_WORDS

if TYPE_CHECKING:
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams  # noqa: F401, in the class's bases

UGV_BASELINES = ("fixed-posture", "level-body", "receding-horizon", "optimum")
AXES = {
    "friction": "between wheels and ground",
    "height, centre, width": "of the ground that is driven over, here a bump [m]",
    "leg_rate": "[rad/m]",
    "spacing": "way of a step [m]",
    "preview_length": "how far the ground is seen [m]",
    "body_mass, wheel_radius": "and any other number of the vehicle",
    "randomisation.track.bump_height.1": "an end of a range that a reset draws from",
}
"""Axes in the help of a sweep."""


class UGVMachine(Machine["UGVEnv", "UGVEnvParams", UGVTrainConfig]):
    """The vehicle on legs: its scenes are grounds."""

    name, title = "ugv", "UGV"
    environment = "UGVEnv"
    configuration = UGVTrainConfig
    modules = (
        "stickslip.dynamics.ugv.params",
        "stickslip.dynamics.ugv.wheel",
        "stickslip.dynamics.ugv.ground.roughness",
        "stickslip.dynamics.ugv.ground.shapes",
        "stickslip.dynamics.ugv.ground.spline",
        "stickslip.dynamics.ugv.track",
        "stickslip.envs.ugv.env",
        "stickslip.envs.ugv.randomisation",
    )
    baselines = UGV_BASELINES
    scenes, scene_files = TRACK_NAMES, "or a file of points"
    axes = AXES
    evaluated = ("return", "cost", "total_energy", "demand", "failures")
    frames = 10.0

    viewed_scene = "bump"
    options: ClassVar = {
        "vehicle": {"metavar": "FILE", "help": "another vehicle: its file in TOML"},
        "criterion": {"metavar": "NAME", "help": "minimised, see below (default: the policy's)"},
    }
    tables: ClassVar = {"criteria of the UGV": CRITERIA_IN_WORDS}
    functions: ClassVar = {
        "stickslip.agents.ugv.task": (
            *("standard_task", "with_options", "label", "details", "parts", "build"),
            *("training_task", "swept"),
        ),
        "stickslip.agents.ugv.controllers": ("baseline",),
        "stickslip.agents.ugv.evaluate": ("measures",),
        "stickslip.agents.ugv.pictures": ("as_episode",),
    }

    def env(self) -> UGVEnv:
        """See Machine."""
        return self.standard_task().env

    def unit_of(self, env: UGVEnv) -> str:
        """See Machine."""
        return f"{env.measure.unit} of {env.criterion}"
