"""The UGV as a machine, and the configuration of its training runs; see agents/machine.py."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from stickslip.agents.machine import Machine
from stickslip.agents.training.configuration import Configuration, drawn, entry, positive, shared
from stickslip.dynamics.checks import nearest, shown
from stickslip.dynamics.names import RANDOM_TRACKS
from stickslip.optim.posture import CRITERIA_IN_WORDS

if TYPE_CHECKING:
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams  # noqa: F401, in the class's bases

FIXED = ("bump", "sinusoid", "ramp", "step", "ditch", "flat", "incline")
GROUND = "random-bump"
"""The ground where none is named."""
TRACK_NAMES = (*RANDOM_TRACKS, *FIXED)
"""See RandomTrack.named; the others are named tracks with their defaults."""
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
OBSERVATION = 9
"""Numbers in an observation, the preview aside."""
LEGS = {"low": 30, "high": 150}
"""Range of the vehicle's legs [degrees]."""


@dataclass(frozen=True)
class UGVTrainConfig(Configuration):
    """Training configuration of the UGV. Defaults take a minute on two cores, mostly to compile.

    The fields' meanings and units are those of `stickslip train ugv --help`, made from them.
    """

    timesteps: int = shared("timesteps", 600_000)

    criterion: str = entry("wheel_energy", str, "minimised", choices=tuple(CRITERIA_IN_WORDS))
    tracks: str = entry(
        GROUND,
        str,
        f"ground, drawn at each start: {', '.join(RANDOM_TRACKS)}; or {', '.join(FIXED)}; or a "
        "file",
    )
    vehicle: str | None = entry(
        None, str, "a vehicle's file in TOML; --set vehicle.NAME=VALUE, too"
    )
    friction: float = entry(0.8, float, "between wheels and ground [-]", low=0)
    random_friction: tuple[float, float] | None = drawn("friction instead")
    leg_rate: float = positive(1.0, "of the legs at action 1 [rad/m]")
    spacing: float = positive(0.1, "way of a step [m]")
    start_angle: float = entry(90.0, float, "of both legs at the start [degrees]", **LEGS)
    random_start: tuple[float, float] | None = entry(
        None, "range", "angles drawn at each start of training episodes instead [degrees]", **LEGS
    )
    preview: int = entry(16, int, "points of the ground ahead that are observed", low=0, high=256)
    preview_length: float = positive(4.0, "how far ahead [m]")
    preview_noise: float | None = entry(None, float, "standard deviation of each [m]", low=0)
    reward_scale: float | None = positive(
        None, "factor on the training reward, by default what makes a usual cost about 1"
    )
    failure: float | None = entry(None, float, "penalty in the scaled training reward", low=0)

    learning_rate: float = shared("learning_rate", 3e-3)
    final_learning_rate: float = shared("final_learning_rate", 3e-4)
    discount: float = shared("discount", 0.95, sb3=0.99)
    epochs: int = shared("epochs", 10)
    noise: float = shared("noise", 1.0)
    final_noise: float = shared("final_noise", 0.2)

    machine = "ugv"
    FLAGS: ClassVar = (*Configuration.FLAGS, "criterion", "tracks", "friction", "vehicle")
    OWN, PARTS = "vehicle", ("vehicle", "motor")
    LEARNING: ClassVar = ("reward_scale",)
    USUALLY: ClassVar = {"random_start": None, "failure": 10.0}

    @classmethod
    def own_machine(cls, path: str | None, changes: Mapping[str, str]) -> dict[str, str]:
        from stickslip.dynamics.ugv import UGVParams
        from stickslip.dynamics.ugv.params import vehicle_text

        vehicle, motor = UGVParams.with_motor(path, changes)
        return {cls.OWN: vehicle_text(vars(vehicle), motor.get("max_torque"))}

    def _check_together(self) -> None:
        require_ground(self.tracks)
        self._require_inside("friction", "random_friction")
        self._require_room(self.preview + OBSERVATION)


def require_ground(name: str) -> None:
    """Raise ValueError for what is neither a known name nor looks like a file's.

    Whether a file is there is asked when it is read: a configuration outlives the files it names.
    """
    if name not in TRACK_NAMES and not Path(name).suffix:
        accepted = f"{', '.join(TRACK_NAMES)}, or a file of points{nearest(name, TRACK_NAMES)}"
        raise ValueError(f"track {shown(name)} is unknown; accepted: {accepted}")


class UGVMachine(Machine["UGVEnv", "UGVEnvParams", UGVTrainConfig]):
    """The vehicle on legs: its scenes are grounds."""

    name, title = "ugv", "UGV"
    environment = "UGVEnv"
    configuration = UGVTrainConfig
    modules = (
        *("stickslip.dynamics.ugv.params", "stickslip.dynamics.ugv.wheel"),
        *("stickslip.dynamics.ugv.ground.roughness", "stickslip.dynamics.ugv.ground.shapes"),
        *("stickslip.dynamics.ugv.ground.spline", "stickslip.dynamics.ugv.track"),
        *("stickslip.envs.ugv.env", "stickslip.envs.ugv.randomisation"),
    )
    baselines: ClassVar = {
        "fixed-posture": "ugv.controllers:FixedPosture",
        "level-body": "ugv.controllers:LevelBody",
        "optimum": "ugv.controllers:Optimum",
    }
    scenes, scene_files = TRACK_NAMES, "or a file of points"
    axes: ClassVar = {
        "friction": "between wheels and ground",
        "height, centre, width": "of the ground that is driven over, here a bump [m]",
        "leg_rate": "[rad/m]",
        "spacing": "way of a step [m]",
        "preview_length": "how far the ground is seen [m]",
        "body_mass, wheel_radius": "and any other number of the vehicle",
        "randomisation.track.bump_height.1": "an end of a range that a reset draws from",
    }
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
        "stickslip.agents.ugv.episodes": ("measures", "as_episode"),
        "stickslip.agents.ugv.regret": ("regrets",),
    }

    def env(self) -> UGVEnv:
        return self.standard_task().env

    def unit_of(self, env: UGVEnv) -> str:
        return f"{env.measure.unit} of {env.criterion}"
