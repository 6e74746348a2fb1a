"""Tasks of the biped: of a configuration, into a policy's file, out of it, changed by options."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, cast

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.machine import TrainingTask
from stickslip.agents.policy.task import numbers_in_words, require_numbers, same_numbers
from stickslip.agents.protocol import Task
from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START, BipedParams
from stickslip.dynamics.names import SCENES
from stickslip.dynamics.scene import Patches, Scene, Smoothed, Uniform
from stickslip.envs.biped.env import BipedEnv
from stickslip.envs.biped.params import (
    MARK,
    NON_NEGATIVE,
    POSITIVE,
    BipedEnvParams,
    Randomisation,
)
from stickslip.envs.tasks.definition import task_by_name

if TYPE_CHECKING:
    from typing import TypeAlias

    from stickslip.agents.biped.config import TrainConfig
    from stickslip.agents.machine import Parts
    from stickslip.agents.protocol import Options

    BipedTask: TypeAlias = Task[BipedEnv, BipedEnvParams]

NUMBERS = (*POSITIVE, *NON_NEGATIVE)
"""Of BipedEnvParams."""
ANY_PHASE = (SUPPORT_START, SUPPORT_END)
WEIGHTS = ("tracking_weight", "slip_weight", "energy_weight", "fall_penalty")
"""Of the reward, which a configuration may give otherwise for training."""
RATE = 3.0
"""Commanded crank rate of the standard task [rad/s]."""


def training_task(config: TrainConfig) -> TrainingTask[BipedEnv, BipedEnvParams]:
    """Build the task. ValueError for an unknown scene or numbers that do not go together.

    Tested are whole episodes with the standard reward, from any phase and up to the commanded rate;
    described is the same from rest. A named task is what it is: starts, length and reward are its
    own, but for what the configuration says of training episodes.
    """
    if config.task is not None:
        env, params = task_by_name(config.task).make("same_step")
        return TrainingTask(cast("BipedEnv", env), _training(config, params), params, params)
    env = BipedEnv(see_friction=config.see_friction, see_patch=config.see_patch)
    drawn = Randomisation(
        friction=config.random_friction,
        mass=config.random_mass,
        payload=config.random_payload,
        mean_rate=config.random_mean_rate,
    )
    scene = Scene.named(config.scene)
    if config.mu_static is not None:
        scene = Scene.uniform(config.mu_static, config.mu_kinetic)
    scene = replace(scene, payload=config.payload).validate()
    rate = config.mean_rate
    rest = env.make_params(randomisation=drawn, scene=scene, mean_rate=rate)
    return TrainingTask(env, _training(config, rest), from_anywhere(rest), rest)


def _training(config: TrainConfig, params: BipedEnvParams) -> BipedEnvParams:
    """The parameters of training episodes: those of a task but for what the configuration gives."""
    given = {name: getattr(config, name) for name in WEIGHTS} | {"time_limit": config.episode_time}
    changed = {name: one for name, one in given.items() if one is not None}
    if config.start_rate is not None:
        starts = {"phase": ANY_PHASE, "crank_rate": (0.0, config.start_rate)}
        changed["randomisation"] = replace(params.randomisation, **starts)
    return params.replace(**changed)


def from_anywhere(params: BipedEnvParams) -> BipedEnvParams:
    """The same task begun at any phase with a crank rate from 0 to the commanded one."""
    fastest = float(np.max(np.asarray(params.mean_rate)))
    start = replace(params.randomisation, phase=ANY_PHASE, crank_rate=(0.0, fastest))
    return params.replace(randomisation=start)


def with_options(task: BipedTask, options: Options, scene: str | None, viewed: bool) -> BipedTask:
    """See Machine; what an option sets is no longer drawn.

    options: mu_static, mu_kinetic, payload, mean_rate, start.
    """
    params = task.params
    floor, load, drawn = params.scene.floor, params.scene.payload, params.randomisation
    changed: Parts = {}
    if scene is not None:
        floor, drawn = Scene.named(scene).floor, replace(drawn, friction=None)
    if options["mu_static"] is not None:
        floor = Scene.uniform(options["mu_static"], options["mu_kinetic"]).floor
        drawn = replace(drawn, friction=None)
    if options["payload"] is not None:
        load, drawn = options["payload"], replace(drawn, payload=None)
    if options["mean_rate"] is not None:
        changed["mean_rate"] = options["mean_rate"]
        drawn = replace(drawn, mean_rate=None, command_interval=None)
    place = replace(params.scene, floor=floor, payload=load).validate()
    given = parts(task.env, task.params) | {"scene": place, "randomisation": drawn}
    given["numbers"] = given["numbers"] | changed
    env, params = build(**given)
    return Task(env, _begun(params, options["start"], "rest" if viewed else "moving"))


def _begun(params: BipedEnvParams, start: str | None, usual: str) -> BipedEnvParams:
    """A task begun as an option says, as it draws it itself, or as usual."""
    drawn = params.randomisation
    if start is None:
        own = drawn.phase is not None or drawn.crank_rate is not None
        start = "" if own else usual
    if start == "rest":
        return params.replace(randomisation=replace(drawn, phase=None, crank_rate=None))
    return from_anywhere(params) if start == "moving" else params


def label(task: BipedTask, scene: str | None) -> str:
    """The floor in a word or two, and what else is not as in the standard task."""
    params, words = task.params, [floor_words(task.params.scene)]
    if params.scene.payload is not None:
        words.append(f"+{float(params.scene.payload):g} kg")
    if (rate := float(params.mean_rate)) != RATE:
        words.append(f"{rate:g} rad/s")
    names = [one for one, ends in vars(params.randomisation).items() if ends is not None]
    drawn = [name for name in names if name not in ("phase", "crank_rate")]
    words += [f"random {', '.join(drawn).replace('_', ' ')}"] if drawn else []
    if not same_numbers(params.robot.bare, BipedParams.from_bars()):
        words.append(f"robot of {float(params.robot.bare.total_mass):.3g} kg")
    return ", ".join(words)


def details(task: BipedTask) -> str:
    """The numbers of the task in a line."""
    floor, numbers = vars(task.params.scene.floor), parts(task.env, task.params)["numbers"]
    words = numbers_in_words({**floor, **numbers}, task.params.randomisation)
    return words if floor else f"no slip, {words}"


def floor_words(scene: Scene) -> str:
    """A scene's name where the floor is that of one, else its numbers."""
    floor = scene.floor
    for name in SCENES:
        if same_numbers(Scene.named(name).floor, floor):
            return name
    if isinstance(floor, Uniform):
        return f"mu {float(floor.mu_static):g}/{float(floor.mu_kinetic):g}"
    if isinstance(floor, Smoothed):
        return f"smoothed mu {float(floor.mu_kinetic):g}"
    count = np.shape(floor.mu_static)[-1] if isinstance(floor, Patches) else 0
    return f"{count} patches"


def parts(env: BipedEnv, params: BipedEnvParams) -> Parts:
    """See Machine; the arguments of `build`."""
    robot = params.robot.bare
    return {
        "env": env,
        "robot": robot,
        "scene": params.scene,
        "randomisation": params.randomisation,
        "dtype": str(jnp.result_type(robot.mass)),
        "numbers": {name: getattr(params, name) for name in NUMBERS} | params.given_mark,
    }


def build(
    env: BipedEnv,
    robot: BipedParams,
    scene: Scene,
    randomisation: Randomisation,
    dtype: str,
    numbers: Parts,
) -> BipedTask:
    """The task of its parts. ValueError for parts that will not do."""
    require_numbers(numbers, NUMBERS, MARK)
    params = env.make_params(
        robot=robot,
        scene=scene,
        randomisation=randomisation,
        dtype=jax.dtypes.canonicalize_dtype(dtype),
        **numbers,
    )
    return Task(env, params)
