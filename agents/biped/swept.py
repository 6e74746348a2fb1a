"""Numbers of the biped's task that a sweep may vary."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from stickslip.agents.sweeps.swept import Swept
from stickslip.dynamics.biped.params import LENGTHS
from stickslip.dynamics.scene import Grip, Smoothed, Uniform
from stickslip.envs.biped.params import NUMBERS

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from jaxtyping import PyTree

    from stickslip.envs.biped.params import BipedEnvParams

FRICTION = ("scene.mu_static", "scene.mu_kinetic")


class BipedSwept(Swept):
    """Numbers of the task, robot, scene and randomisation."""

    units: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(LENGTHS, "m"),
        "task.torque_limit": "N m",
        "task.control_period": "s",
        "task.mean_rate": "rad/s",
        "task.time_limit": "s",
        "task.max_crank_rate": "rad/s",
        "task.copper_loss": "W/(N m)^2",
        "task.mark": "m",
        "task.mark_width": "m",
        "scene.payload": "kg",
        "scene.edges": "m",
        "scene.slip_speed": "m/s",
        "robot.mass": "kg",
        "robot.centre": "m",
        "robot.inertia": "kg m^2",
        "robot.gravity": "m/s^2",
        "randomisation.payload": "kg",
        "randomisation.mean_rate": "rad/s",
        "randomisation.phase": "rad",
        "randomisation.crank_rate": "rad/s",
        "randomisation.command_interval": "s",
        "randomisation.mark": "m",
    }
    kept: ClassVar[Mapping[str, str]] = {
        "reward": "-",
        "duration": "s",
        "turned": "rad",
        "walked": "m",
        "slid": "m",
        "energy": "J",
        "weight": "N",
    }
    slip: ClassVar[tuple[str, str] | None] = ("slid", "walked")
    short: ClassVar[Mapping[str, tuple[str, ...]]] = {"mu": FRICTION}

    def parts(self, params: BipedEnvParams) -> dict[str, PyTree]:
        """See Swept; the payload is the scene's, with which the robot is prepared."""
        payload = 0.0 if params.scene.payload is None else params.scene.payload
        robot = vars(params.robot.bare)
        return {
            "task": {name: getattr(params, name) for name in NUMBERS} | params.given_mark,
            "scene": {**vars(params.scene.floor), "payload": payload},
            "robot": {name: value for name, value in robot.items() if name != "payload"},
            "randomisation": params.randomisation,
        }

    def with_parts(
        self, params: BipedEnvParams, parts: Mapping[str, PyTree], names: Iterable[str]
    ) -> BipedEnvParams:
        """See Swept. What an axis sets is no longer drawn; where the start's crank rates end at the
        commanded one, they go on doing so."""
        names = set(names)
        touched = {name.partition(".")[0] for name in names}
        drawn = parts["randomisation"]
        changed: dict[str, PyTree] = dict(parts["task"])
        if "scene" in touched:
            floor = {one: value for one, value in parts["scene"].items() if one != "payload"}
            scene = replace(params.scene, floor=replace(params.scene.floor, **floor))
            if "scene.payload" in names:
                scene = replace(scene, payload=parts["scene"]["payload"])
                drawn = replace(drawn, payload=None)
            if names & set(FRICTION) or any(name.startswith("scene.mu_") for name in names):
                drawn = replace(drawn, friction=None)
            changed["scene"] = scene
        if "task.mark" in names:
            drawn = replace(drawn, mark=None)
        if "task.mean_rate" in names:
            drawn = replace(drawn, mean_rate=None, command_interval=None)
            if drawn.crank_rate is not None and _ends_at_command(params):
                ends = (drawn.crank_rate[0], changed["mean_rate"])
                drawn = replace(drawn, crank_rate=ends)
        changed["randomisation"] = drawn
        if "robot" in touched:
            changed["robot"] = replace(params.robot.bare, **parts["robot"])
        return params.replace(**changed)

    def opened(self, params: BipedEnvParams, names: Iterable[str]) -> BipedEnvParams:
        """See Swept: `mu` makes the floor the same everywhere, `payload` loads the robot."""
        scene = params.scene
        if "mu" in names and not isinstance(scene.floor, Uniform):
            scene = replace(scene, floor=Uniform(0.0, 0.0))
        if {"payload", "scene.payload"} & set(names) and scene.payload is None:
            scene = replace(scene, payload=0.0)
        if scene is params.scene:
            return params
        drawn = params.randomisation
        if isinstance(params.scene.floor, Grip | Smoothed) or "mu" in names:
            drawn = replace(drawn, friction=None)
        return params.replace(scene=scene, randomisation=drawn)

    def require_within(self, params: BipedEnvParams) -> None:
        """See Swept."""
        params.validate()


def _ends_at_command(params: BipedEnvParams) -> bool:
    drawn = params.randomisation.crank_rate
    return drawn is not None and bool(np.all(np.float32(drawn[1]) == np.float32(params.mean_rate)))
