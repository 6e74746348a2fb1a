"""Numbers of the UGV's task that a sweep may vary."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

from stickslip.agents.sweeps.swept import Swept

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from jaxtyping import PyTree

    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams

NUMBERS = (
    "friction",
    "leg_rate",
    "min_clearance",
    "max_torque",
    "spacing",
    "start",
    "end",
    "start_angles",
    "preview_length",
    "preview_noise",
    "failure_penalty",
    "reward_scale",
    "speed",
)
"""Of UGVEnvParams; those that are None have no place in the program."""


class UGVSwept(Swept):
    """Numbers of the task, vehicle, track and randomisation."""

    units: ClassVar[Mapping[str, str]] = {
        "task.leg_rate": "rad/m",
        "task.spacing": "m",
        "task.start": "m",
        "task.end": "m",
        "task.start_angles": "rad",
        "task.min_clearance": "m",
        "task.preview_length": "m",
        "task.preview_noise": "m",
        "task.max_torque": "N m",
        "task.speed": "m/s",
        "randomisation.start_angles": "rad",
        "randomisation.track.roughness": "m^3",
        **dict.fromkeys(("body_length", "leg_length", "wheel_radius", "wheel_gap"), "m"),
        **dict.fromkeys(("wheel_mass", "body_mass", "leg_mass"), "kg"),
        **dict.fromkeys(("leg_angle_min", "leg_angle_max"), "rad"),
        "vehicle.gravity": "m/s^2",
        **dict.fromkeys(("height", "centre", "width", "amplitude", "wavelength"), "m"),
        **dict.fromkeys(("position", "length", "joint", "depth", "side"), "m"),
        **dict.fromkeys(("bump_height", "bump_width", "bump_centre"), "m"),
        "track.start": "m",
        "track.end": "m",
    }
    kept: ClassVar[Mapping[str, str]] = {
        "reward": "-",
        "cost": "-",
        "distance": "m",
        "wheel_energy": "J",
        "total_energy": "J",
        "demand": "-",
    }

    def parts(self, params: UGVEnvParams) -> dict[str, PyTree]:
        """See Swept; of a ground that is drawn, its ranges stand under randomisation."""
        given = {name: getattr(params, name) for name in NUMBERS}
        return {
            "task": {name: value for name, value in given.items() if value is not None},
            "track": vars(params.track.shape) if params.randomisation.track is None else {},
            "vehicle": vars(params.vehicle),
            "randomisation": params.randomisation,
        }

    def with_parts(
        self, params: UGVEnvParams, parts: Mapping[str, PyTree], names: Iterable[str]
    ) -> UGVEnvParams:
        """See Swept. What an axis sets is no longer drawn."""
        names = set(names)
        touched = {name.partition(".")[0] for name in names}
        drawn = parts["randomisation"]
        own = {name.split(".")[1] for name in names if name.startswith("task.")}
        changed: dict[str, PyTree] = {name: parts["task"][name] for name in own}
        drawn = replace(drawn, **dict.fromkeys(own & {"friction", "start_angles"}))
        if "track" in touched:
            shape: PyTree = params.track.shape
            shape = replace(shape, **parts["track"])
            changed["track"] = replace(params.track, shape=shape)
        if "vehicle" in touched:
            changed["vehicle"] = replace(params.vehicle, **parts["vehicle"])
        return params.replace(**changed, randomisation=drawn)

    def kept_units(self, env: UGVEnv) -> Mapping[str, str]:
        """See Swept; the cost in the criterion's unit."""
        return {**self.kept, "cost": env.measure.unit}
