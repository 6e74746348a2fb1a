"""A task of the biped in parts: into a policy's file, out of it again, changed by options."""

from __future__ import annotations

from dataclasses import asdict, fields, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.biped.scenes import SCENES, scene_by_name
from stickslip.agents.tasks.file import in_words, plain, rebuilt_task, same_numbers, task_entry
from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START, BipedParams
from stickslip.dynamics.scene import Patches, Scene, Smoothed, Uniform
from stickslip.envs.biped.env import BipedEnv
from stickslip.envs.biped.params import (
    MARK,
    NON_NEGATIVE,
    POSITIVE,
    BipedEnvParams,
    Randomisation,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.agents.machine import Options
    from stickslip.agents.untrusted import Json

NUMBERS = (*POSITIVE, *NON_NEGATIVE)
"""Of BipedEnvParams."""
PARTS = ("env", "robot", "scene", "randomisation", "dtype", "numbers")
SIGHTS = ("see_friction", "see_patch")
ANY_PHASE = (SUPPORT_START, SUPPORT_END)


class BipedTask(NamedTuple):
    """Arguments of `BipedEnv.make_params`."""

    env: BipedEnv
    robot: BipedParams
    scene: Scene
    randomisation: Randomisation
    dtype: str
    numbers: dict[str, Any]
    """By the names of NUMBERS, and of MARK where there is one."""

    @classmethod
    def of(cls, env: BipedEnv, params: BipedEnvParams) -> BipedTask:
        """The parts of a task."""
        numbers = {name: getattr(params, name) for name in NUMBERS} | params.given_mark
        robot = params.robot.bare
        dtype = str(jnp.result_type(robot.mass))
        return cls(env, robot, params.scene, params.randomisation, dtype, numbers)

    def params(self) -> BipedEnvParams:
        """The environment's parameters. ValueError for parts that will not do."""
        dtype = jax.dtypes.canonicalize_dtype(self.dtype)
        return self.env.make_params(
            robot=self.robot,
            scene=self.scene,
            randomisation=self.randomisation,
            dtype=dtype,
            **self.numbers,
        )

    def with_options(self, options: Options, scene: str | None) -> BipedTask:
        """The task with what options ask for instead; what one of them sets is no longer drawn.

        options: mu_static, mu_kinetic, payload, commanded_rate, each None where it is not given.
        """
        floor, load, drawn = self.scene.floor, self.scene.payload, self.randomisation
        numbers = dict(self.numbers)
        if scene is not None:
            floor, drawn = scene_by_name(scene).floor, replace(drawn, friction=None)
        if options["mu_static"] is not None:
            floor = Scene.uniform(options["mu_static"], options["mu_kinetic"]).floor
            drawn = replace(drawn, friction=None)
        if options["payload"] is not None:
            load, drawn = options["payload"], replace(drawn, payload=None)
        if options["commanded_rate"] is not None:
            numbers["commanded_rate"] = options["commanded_rate"]
            drawn = replace(drawn, commanded_rate=None, command_interval=None)
        changed = replace(self.scene, floor=floor, payload=load).validate()
        return self._replace(scene=changed, randomisation=drawn, numbers=numbers)

    def label(self, scene: str | None) -> str:
        """The floor in a word or two, and what else is not as in the standard task."""
        usual, words = standard_task({}), [floor_words(self.scene)]
        if self.scene.payload is not None:
            words.append(f"+{float(self.scene.payload):g} kg")
        rate = float(self.numbers["commanded_rate"])
        if rate != usual.numbers["commanded_rate"]:
            words.append(f"{rate:g} rad/s")
        drawn = [one.name for one in fields(self.randomisation) if self._draws(one.name)]
        words += [f"random {', '.join(drawn).replace('_', ' ')}"] if drawn else []
        if not same_numbers(self.robot, usual.robot):
            words.append(f"robot of {float(self.robot.total_mass):.3g} kg")
        return ", ".join(words)

    def details(self) -> str:
        """The numbers of the task in a line."""
        floor = {name: in_words(plain(value)) for name, value in vars(self.scene.floor).items()}
        words = [f"{name} {value}" for name, value in floor.items()] or ["no slip"]
        words += [f"{name} {in_words(plain(value))}" for name, value in self.numbers.items()]
        for one in fields(self.randomisation):
            ends = getattr(self.randomisation, one.name)
            if ends is not None:
                words.append(f"{one.name} drawn from {float(ends[0]):.4g} to {float(ends[1]):.4g}")
        return ", ".join(words).replace("_", " ")

    def _draws(self, name: str) -> bool:
        own = name not in ("phase", "crank_rate")
        return own and getattr(self.randomisation, name) is not None


def describe_environment(env: BipedEnv, params: BipedEnvParams) -> dict[str, Json]:
    """The configuration of an environment as JSON values, for a policy's metadata.

    Static choices, floor, randomisation and every number, of the robot its mass, and the size of
    the observation, for people; and all of it again in parts, for `read_task`.
    """
    task, scene = BipedTask.of(env, params), params.scene
    return {
        "environment": type(env).__name__,
        "choices": {name: plain(value) for name, value in asdict(env).items()},
        "floor": {"kind": type(scene.floor).__name__}
        | {name: plain(value) for name, value in vars(scene.floor).items()},
        "steps": scene.steps,
        "payload": plain(scene.payload),
        "randomisation": plain(vars(params.randomisation)),
        "total_mass": plain(params.robot.total_mass),
        "observation_size": len(env.observation_bounds(params)[0]),
        **{name: plain(value) for name, value in task.numbers.items()},
        **task_entry(**task._asdict()),
    }


def read_task(metadata: Mapping[str, Json]) -> BipedTask | None:
    """The task in a policy's metadata; None where there is none. ValueError for a damaged one."""
    kinds = {"env": BipedEnv, "robot": BipedParams, "scene": Scene} | {
        "randomisation": Randomisation
    }
    return rebuilt_task(metadata, BipedTask, PARTS, kinds, NUMBERS, MARK)


def standard_task(metadata: Mapping[str, Json]) -> BipedTask:
    """The standard task, with the sights that a policy's file tells of."""
    choices = metadata.get("choices")
    known = choices if isinstance(choices, dict) else {}
    sights = {name: known.get(name) is True for name in SIGHTS}
    env = BipedEnv(see_friction=sights["see_friction"], see_patch=sights["see_patch"])
    return BipedTask.of(env, env.default_params)


def floor_words(scene: Scene) -> str:
    """A scene's name where the floor is that of one, else its numbers."""
    for name, one in SCENES.items():
        if same_numbers(one.floor, scene.floor):
            return name
    floor = scene.floor
    if isinstance(floor, Uniform):
        return f"mu {float(floor.mu_static):g}/{float(floor.mu_kinetic):g}"
    if isinstance(floor, Smoothed):
        return f"smoothed mu {float(floor.mu_kinetic):g}"
    count = np.shape(floor.mu_static)[-1] if isinstance(floor, Patches) else 0
    return f"{count} patches"


def begun(params: BipedEnvParams, start: str | None, usual: str) -> BipedEnvParams:
    """A task begun as an option says, as it draws it itself, or as usual."""
    drawn = params.randomisation
    if start is None:
        own = drawn.phase is not None or drawn.crank_rate is not None
        start = "" if own else usual
    if start == "rest":
        return params.replace(randomisation=replace(drawn, phase=None, crank_rate=None))
    return from_anywhere(params) if start == "moving" else params


def from_anywhere(params: BipedEnvParams) -> BipedEnvParams:
    """The same task begun at any phase with a crank rate from 0 to the commanded one."""
    fastest = float(np.max(np.asarray(params.commanded_rate)))
    start = replace(params.randomisation, phase=ANY_PHASE, crank_rate=(0.0, fastest))
    return params.replace(randomisation=start)
