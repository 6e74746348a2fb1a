"""Tasks of the biped: of a configuration, into a policy file and out of it, by options and axes."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, TypeAlias, cast

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.biped.machine import TrainConfig
from stickslip.agents.machine import Parts, TrainingTask
from stickslip.agents.policy import task as tasks
from stickslip.agents.protocol import Options, Task
from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START, BipedParams
from stickslip.dynamics.biped.robot_file import BARS, NAMES, ROBOT, bars_of, robot_text
from stickslip.dynamics.names import LENGTHS, SCENES
from stickslip.dynamics.scene import Grip, Patches, Scene, Uniform
from stickslip.envs.biped.env import BipedEnv
from stickslip.envs.biped.params import NUMBERS, OPTIONAL, BipedEnvParams, Randomisation
from stickslip.envs.tasks.definition import task_by_name

if TYPE_CHECKING:
    from jaxtyping import PyTree

    from stickslip.agents.sweeps.swept import Swept
    from stickslip.dynamics.pytrees import Number

    BipedTask: TypeAlias = Task[BipedEnv, BipedEnvParams]

ANY_PHASE = (SUPPORT_START, SUPPORT_END)
WEIGHTS = ("tracking_weight", "slip_weight", "energy_weight", "fall_penalty")
"""Weights of the reward, which a configuration may change for training."""
DRAWN = {
    "scene.payload": ("payload",),
    "task.mark": ("mark",),
    "task.mean_rate": ("mean_rate", "command_interval"),
}
"""Draws that an axis takes the place of; those of friction, the floor's."""

UNITS = {
    **dict.fromkeys(LENGTHS, "m"),
    **dict.fromkeys(("mark", "mark_width", "edges", "centre"), "m"),
    **dict.fromkeys(("control_period", "time_limit", "command_interval"), "s"),
    **dict.fromkeys(("mean_rate", "crank_rate", "max_crank_rate"), "rad/s"),
    "task.torque_limit": "N m",
    "task.copper_loss": "W/(N m)^2",
    "task.max_power": "W",
    "task.cost_limit": "m",
    "task.encoder_noise": "rad",
    "payload": "kg",
    "robot.mass": "kg",
    "robot.inertia": "kg m^2",
    "robot.gravity": "m/s^2",
    **{f"bars.{name}": unit for name, unit in BARS.items()},
    "bars": "crank lengths",
    "randomisation.phase": "rad",
}
"""Units of numbers that a sweep may vary."""


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
    names = ("friction", "mass", "payload", "mean_rate")
    drawn = Randomisation(**{name: getattr(config, f"random_{name}") for name in names})
    scene = Scene.named(config.scene)
    if config.mu_static is not None:
        scene = Scene.uniform(config.mu_static, config.mu_kinetic)
    scene = replace(scene, payload=config.payload).validate()
    given: Parts = {"randomisation": drawn, "scene": scene, "mean_rate": config.mean_rate}
    rest = env.make_params(**given, **tasks.own_machine(BipedParams, "robot", config.robot))
    return TrainingTask(env, _training(config, rest), from_anywhere(rest), rest)


def _training(config: TrainConfig, params: BipedEnvParams) -> BipedEnvParams:
    """The parameters of training episodes: those of a task but for what the configuration gives."""
    given = {name: getattr(config, name) for name in WEIGHTS} | {"time_limit": config.episode_time}
    changed = {name: one for name, one in given.items() if one is not None}
    if config.episode_time is not None and params.cost_limit is not None:  # its share of the limit
        changed["cost_limit"] = params.cost_limit * (config.episode_time / params.time_limit)
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
    """See Machine; what an option sets is no longer drawn. options: robot, start."""
    given, drawn = parts(task.env, task.params), task.params.randomisation
    if scene is not None:
        given["scene"] = replace(given["scene"], floor=Scene.named(scene).floor)
        drawn = replace(drawn, friction=None)
    path, changes, bare = options["robot"], options.get("changes"), given["robot"]
    robot = task.params.only_robot
    reference = robot is None or tasks.same_numbers(robot, BipedParams.from_bars())
    if path is None and changes and not reference:
        path = robot_text(vars(robot))
    own = tasks.own_machine(BipedParams, "robot", path, changes)
    drawn = replace(drawn, robot=None) if "robot" in own else drawn
    given["robot"] = own.pop("robot", bare)
    given |= {"numbers": given["numbers"] | own, "randomisation": drawn}
    env, params = build(**given)
    params = swept().changed(params, options["numbers"])
    return Task(env, _begun(params, options["start"], "rest" if viewed else "moving"))


def _begun(params: BipedEnvParams, start: str | None, usual: str) -> BipedEnvParams:
    """A task begun as an option says, as it draws it itself, or as usual."""
    drawn = params.randomisation
    if start is None:
        start = "" if drawn.phase is not None or drawn.crank_rate is not None else usual
    if start == "rest":
        return params.replace(randomisation=replace(drawn, phase=None, crank_rate=None))
    return from_anywhere(params) if start == "moving" else params


def label(task: BipedTask, scene: str | None) -> str:
    """The floor in a word or two, and what else is not as in the standard task."""
    params, words = task.params, [floor_words(task.params.scene)]
    if params.scene.payload is not None:
        words.append(f"+{float(params.scene.payload):g} kg")
    if (rate := float(params.mean_rate)) != TrainConfig.mean_rate:
        words.append(f"{rate:g} rad/s")
    names = [one for one, ends in vars(params.randomisation).items() if ends is not None]
    drawn = [name for name in names if name not in ("phase", "crank_rate")]
    words += [f"random {', '.join(drawn).replace('_', ' ')}"] if drawn else []
    robot = params.only_robot
    if robot is not None and not tasks.same_numbers(robot, BipedParams.from_bars()):
        words.append(f"robot of {float(robot.total_mass):.3g} kg")
    return ", ".join(words)


def details(task: BipedTask) -> str:
    """The numbers of the task in a line."""
    floor, numbers = vars(task.params.scene.floor), parts(task.env, task.params)["numbers"]
    late = {"delay": task.env.delay} if task.env.delay else {}
    words = tasks.numbers_in_words({**floor, **numbers, **late}, task.params.randomisation)
    return words if floor else f"no slip, {words}"


def floor_words(scene: Scene) -> str:
    """A scene's name where the floor is that of one, else its numbers."""
    floor = scene.floor
    for name in SCENES:
        if tasks.same_numbers(Scene.named(name).floor, floor):
            return name
    if isinstance(floor, Uniform):
        return f"mu {float(floor.mu_static):g}/{float(floor.mu_kinetic):g}"
    count = np.shape(floor.mu_static)[-1] if isinstance(floor, Patches) else 0
    return f"{count} patches"


def _numbers_of(params: BipedEnvParams) -> dict[str, PyTree]:
    """The task's numbers, and those of a mark where it has one."""
    numbers = {name: getattr(params, name) for name in (*NUMBERS, *OPTIONAL)}
    return {name: one for name, one in numbers.items() if one is not None}


def parts(env: BipedEnv, params: BipedEnvParams) -> Parts:
    """See Machine; the arguments of `build`."""
    robot = params.robot.bare
    return {
        "env": env,
        "robot": robot,
        "scene": params.scene,
        "randomisation": params.randomisation,
        "dtype": str(jnp.result_type(robot.mass)),
        "numbers": _numbers_of(params),
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
    tasks.require_numbers(numbers, NUMBERS, OPTIONAL)
    kind, own = jax.dtypes.canonicalize_dtype(dtype), {"robot": robot, "scene": scene}
    return Task(env, env.make_params(**own, randomisation=randomisation, dtype=kind, **numbers))


def swept() -> Swept:
    """See Machine: numbers of the task, robot, scene and randomisation."""
    from stickslip.agents.sweeps.swept import Swept

    how = {"parts": swept_parts, "with_parts": with_swept, "opened": opened}
    aliases: dict[str, tuple[str, ...]] = {"mu": ("scene.mu_static", "scene.mu_kinetic")}
    aliases |= {name: (_field_of(place),) for name, place in ROBOT.names.items()}
    return Swept(UNITS, ("slid", "walked"), aliases, **how)


def _field_of(place: str) -> str:
    """The dotted name of a number at a place of a robot's file."""
    table, *name = place.split(".")
    if table == "links":
        link, field, *axis = name
        return ".".join(("robot", field, str(NAMES.index(link)), *axis))
    part = {"lengths": "robot", "motor": "task", "bars": "bars"}.get(table)
    return f"robot.{place}" if part is None else ".".join((part, *name))


def swept_parts(params: BipedEnvParams) -> dict[str, PyTree]:
    """See Swept; bars: the arguments of `from_bars` that make the robot, unless one is drawn."""
    payload = 0.0 if params.scene.payload is None else params.scene.payload
    robot = params.only_robot
    bars = {} if robot is None else bars_of(robot)
    return {
        "task": _numbers_of(params),
        "scene": {**vars(params.scene.floor), "payload": payload},
        "robot": {} if robot is None else vars(robot),
        "randomisation": params.randomisation,
        "bars": {name.removeprefix("bars."): value for name, value in bars.items()},
    }


def with_swept(
    params: BipedEnvParams, parts: Mapping[str, PyTree], values: Mapping[str, Number]
) -> BipedEnvParams:
    """See Swept. What an axis sets is no longer drawn; where the start's crank rates end at the
    commanded one, they go on doing so."""
    floor = dict(parts["scene"])
    touched = {name.partition(".")[0] for name in values}
    drawn, changed = parts["randomisation"], dict(parts["task"])
    payload = floor.pop("payload")
    if "scene" in touched:
        loaded = {"payload": payload} if "scene.payload" in values else {}
        floor = replace(params.scene.floor, **floor)
        changed["scene"] = replace(params.scene, floor=floor, **loaded)
    rates = params.randomisation.crank_rate
    if "task.mean_rate" in values and drawn.crank_rate is not None and rates is not None:
        low, high = rates
        if np.all(np.float32(high) == np.float32(params.mean_rate)):
            drawn = replace(drawn, crank_rate=(low, changed["mean_rate"]))
    gone = [one for name in values for one in DRAWN.get(name, ())]
    gone += ["friction"] if any(name.startswith("scene.mu_") for name in values) else []
    changed["randomisation"] = replace(drawn, **dict.fromkeys(gone))
    own = {name: one for name, one in values.items() if name.startswith(("robot.", "bars."))}
    if own:
        changed["robot"] = params.robot.bare.changed(own)
    return params.replace(**changed)


def opened(params: BipedEnvParams, names: Collection[str]) -> BipedEnvParams:
    """See Swept: `mu`, or both frictions, make the floor the same everywhere, `payload` loads the
    robot, and a motor gets the limits that are named."""
    last = {name.rpartition(".")[2] for name in names}
    motor = {name: 1.0 for name in ("max_power", "efficiency") if name in last}
    params = params.replace(**motor) if motor else params
    scene, same = params.scene, "mu" in names or {"mu_static", "mu_kinetic"} <= set(names)
    if same and not isinstance(scene.floor, Uniform):
        scene = replace(scene, floor=Uniform(0.0, 0.0))
    if {"payload", "scene.payload"} & set(names) and scene.payload is None:
        scene = replace(scene, payload=0.0)
    if scene is params.scene:
        return params
    drawn = params.randomisation
    if isinstance(params.scene.floor, Grip) or same:
        drawn = replace(drawn, friction=None)
    return params.replace(scene=scene, randomisation=drawn)
