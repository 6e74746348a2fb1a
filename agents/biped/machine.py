"""The biped as a machine. See stickslip.agents.machine.Machine."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from stickslip.agents.biped.config import TrainConfig
from stickslip.agents.machine import Machine
from stickslip.dynamics.names import SCENES

if TYPE_CHECKING:
    from stickslip.envs.biped.env import BipedEnv
    from stickslip.envs.biped.params import BipedEnvParams

BIPED_BASELINES = (
    "constant-torque",
    "crank-speed-pi",
    "computed-torque",
    "optimal-gait",
    "stop-at-mark",
)
STOPPING = "stop-at-mark"
"""The one for tasks with a mark; without one it follows gaits as optimal-gait does."""
AXES = {
    "mu": "static and kinetic friction of one floor",
    "mu_static, mu_kinetic": "either, of the task's floor",
    "payload": "mass on the hip [kg]",
    "mean_rate": "mean crank rate [rad/s]",
    "torque_limit": "of the motor [N m]",
    "slip_weight, energy_weight": "of the reward, and its other weights",
    "robot.crank_length": "[m], and any other number of the robot, named as by --set",
    "randomisation.friction.0": "an end of a range that a reset draws from",
}
"""Axes in the help of a sweep."""
STARTS = ("moving", "rest")


class BipedMachine(Machine["BipedEnv", "BipedEnvParams", TrainConfig]):
    """PASIBOT: its scenes are floors."""

    name = title = "biped"
    environment = "BipedEnv"
    configuration = TrainConfig
    modules = (
        "stickslip.dynamics.biped.params",
        "stickslip.dynamics.biped.model",
        "stickslip.dynamics.biped.inertia",
        "stickslip.dynamics.biped.settings",
        "stickslip.dynamics.scene",
        "stickslip.envs.biped.env",
        "stickslip.envs.biped.params",
    )
    baselines = BIPED_BASELINES
    scenes = SCENES
    axes, measured = AXES, "stickslip.agents.biped.evaluate"
    evaluated = (
        *("return", "mean_speed", "mean_crank_rate", "slip_per_metre", "energy_per_metre"),
        "falls",
    )
    film_time = 6.0

    options: ClassVar = {
        "robot": {"metavar": "FILE", "help": "another robot: its file in TOML"},
        "start": {
            "choices": STARTS,
            "help": "at any phase and rate, or (default of `view`) at rest",
        },
    }

    functions: ClassVar = {
        "stickslip.agents.biped.task": (
            *("with_options", "label", "details", "parts", "build", "training_task", "swept"),
        ),
        "stickslip.agents.biped.controllers": ("baseline",),
        "stickslip.agents.biped.pictures": ("as_episode",),
        "stickslip.agents.exchange.mujoco_env": ("moved_by",),
    }

    def env(self) -> BipedEnv:
        """See Machine."""
        from stickslip.envs.biped.env import BipedEnv

        return BipedEnv()

    def params_to_view(self, params: BipedEnvParams, seconds: float) -> BipedEnvParams:
        """An episode is as long as what is shown of it."""
        return params.replace(time_limit=seconds)
