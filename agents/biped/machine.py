"""The biped as a machine, and the configuration of its training runs; see agents/machine.py."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from stickslip.agents.machine import Machine
from stickslip.agents.training.configuration import Configuration, drawn, entry, positive, shared
from stickslip.dynamics.names import SCENES

if TYPE_CHECKING:
    from stickslip.envs.biped.env import BipedEnv
    from stickslip.envs.biped.params import BipedEnvParams

SCENE = "slippery"
"""The floor where none is named."""

BIPED_OBSERVATION = 10
"""Numbers in its longest observation."""


@dataclass(frozen=True)
class TrainConfig(Configuration):
    """Training configuration of the biped. The defaults learn to walk the slippery floor with PPO.

    The fields' meanings and units are those of `stickslip train biped --help`, made from them.
    """

    timesteps: int = shared("timesteps", 8_000_000, sb3=6_000_000)

    scene: str = entry(SCENE, str, "floor", choices=SCENES)
    mu_static: float | None = entry(None, float, "one floor instead", low=0)
    mu_kinetic: float | None = entry(None, float, "kinetic, by default mu_static", low=0)
    payload: float | None = entry(None, float, "on the hip [kg]", low=0)
    mean_rate: float = positive(3.0, "mean crank rate [rad/s]")
    see_friction: bool = entry(False, bool, "the policy observes the friction underfoot")
    see_patch: bool = entry(False, bool, "the policy observes the next patch of floor")

    robot: str | None = entry(None, str, "a robot's file in TOML; --set robot.NAME=VALUE, too")
    random_friction: tuple[float, float] | None = drawn("factor on every friction")
    random_mass: tuple[float, float] | None = drawn("factor on every mass", 1e-6)
    random_payload: tuple[float, float] | None = drawn("payload [kg]")
    random_mean_rate: tuple[float, float] | None = drawn("commanded rate [rad/s]", 1e-6)
    start_rate: float | None = entry(
        None, float, "training starts at any phase, up to this crank rate [rad/s]", low=0, high=20
    )
    episode_time: float | None = entry(None, float, "length of training episodes [s]", low=0.02)
    tracking_weight: float | None = entry(None, float, "of speed in the training reward", low=0)
    slip_weight: float | None = entry(None, float, "of slip in the training reward", low=0)
    energy_weight: float | None = entry(None, float, "of energy in the training reward", low=0)
    fall_penalty: float | None = entry(None, float, "of a fall in the training reward", low=0)

    num_envs: int = shared("num_envs", 1024, sb3=256)
    learning_rate: float = shared("learning_rate", 2e-3, sb3=1e-3)
    discount: float = shared("discount", 0.98, sb3=0.99)
    batch_size: int = shared("batch_size", 4096)
    hidden: int = shared("hidden", 32, sb3=64)
    rollout_steps: int = shared("rollout_steps", 32, sb3=128)
    epochs: int = shared("epochs", 4, sb3=6)
    noise: float = shared("noise", 0.3, sb3=0.22)
    final_noise: float = shared("final_noise", 0.02, sb3=0.03)

    checkpoint_interval: int = shared("checkpoint_interval", 262_144)
    evaluation_episodes: int = shared("evaluation_episodes", 64)

    machine = "biped"
    FLAGS: ClassVar = (*Configuration.FLAGS, "scene", "mu_static", "mu_kinetic", "payload")
    FLAGS += ("mean_rate", "robot")
    OWN, PARTS = "robot", ("robot", "bars", "motor")
    USUALLY: ClassVar = {
        "start_rate": 5.0,
        "episode_time": 1.5,
        "tracking_weight": 1.0,
        "slip_weight": 3.0,
        "energy_weight": 0.5,
        "fall_penalty": 1.0,
    }

    @classmethod
    def own_machine(cls, path: str | None, changes: Mapping[str, str]) -> dict[str, str]:
        from stickslip.dynamics.biped import BipedParams
        from stickslip.dynamics.biped.robot_file import robot_text
        from stickslip.dynamics.biped.settings import precision

        with precision("float64"):
            robot, motor = BipedParams.with_motor(path, changes)
        return {cls.OWN: robot_text(vars(robot), motor)}

    def _check_together(self) -> None:
        self._require_room(BIPED_OBSERVATION)
        self._require_inside("mean_rate", "random_mean_rate")
        if self.mu_static is not None and self.scene != SCENE:
            raise ValueError(
                f"scene = {self.scene!r} with mu_static = {self.mu_static}: both say which floor; "
                "accepted: one of them"
            )
        if self.payload is not None and self.random_payload is not None:
            raise ValueError("payload with random_payload; accepted: one of them")
        if self.mu_kinetic is not None and self.mu_static is None:
            given = f"mu_kinetic = {self.mu_kinetic} without mu_static"
            raise ValueError(f"{given}; accepted: both, mu_static alone or neither")


class BipedMachine(Machine["BipedEnv", "BipedEnvParams", TrainConfig]):
    """PASIBOT: its scenes are floors."""

    name = title = "biped"
    environment = "BipedEnv"
    configuration = TrainConfig
    modules = (
        *("stickslip.dynamics.biped.params", "stickslip.dynamics.biped.model"),
        *("stickslip.dynamics.biped.inertia", "stickslip.dynamics.biped.settings"),
        *("stickslip.dynamics.scene", "stickslip.envs.biped.env", "stickslip.envs.biped.params"),
    )
    baselines: ClassVar = {
        "constant-torque": "biped.controllers:ConstantTorque",
        "crank-speed-pi": "biped.controllers:CrankSpeedPI",
        "computed-torque": "biped.prediction:ComputedTorque",
        "optimal-gait": "biped.prediction:OptimalGait",
        "stop-at-mark": "biped.controllers:StopAtMark",
        "output-feedback": "biped.output_feedback:OutputFeedback",
    }
    scenes = SCENES
    axes: ClassVar = {
        "mu": "static and kinetic friction of one floor",
        "mu_static, mu_kinetic": "either, of the task's floor",
        "payload": "mass on the hip [kg]",
        "mean_rate": "mean crank rate [rad/s]",
        "torque_limit": "of the motor [N m]",
        "slip_weight, energy_weight": "of the reward, and its other weights",
        "robot.crank_length": "[m], and any other number of the robot, named as by --set",
        "randomisation.friction.0": "an end of a range that a reset draws from",
    }
    evaluated = ("return", "mean_speed", "mean_crank_rate", "slip_per_metre", "energy_per_metre")
    evaluated += ("falls",)
    film_time = 6.0

    options: ClassVar = {
        "robot": {"metavar": "FILE", "help": "another robot: its file in TOML"},
        "start": {
            "choices": ("moving", "rest"),
            "help": "at any phase and rate, or (default of `view`) at rest",
        },
    }

    functions: ClassVar = {
        "stickslip.agents.biped.task": (
            *("with_options", "label", "details", "parts", "build", "training_task", "swept"),
        ),
        "stickslip.agents.biped.measures": ("measures",),
        "stickslip.agents.biped.episodes": ("as_episode",),
        "stickslip.agents.exchange.mujoco_env": ("moved_by",),
    }

    def env(self) -> BipedEnv:
        from stickslip.envs.biped.env import BipedEnv

        return BipedEnv()

    def params_to_view(self, params: BipedEnvParams, seconds: float) -> BipedEnvParams:
        """An episode is as long as what is shown of it."""
        return params.replace(time_limit=seconds)
