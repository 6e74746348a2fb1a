"""Tasks of the UGV: of a configuration, in a policy's file, changed by options or swept over."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias, cast

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.machine import Parts, TrainingTask
from stickslip.agents.policy import task as tasks
from stickslip.agents.protocol import Options, Task
from stickslip.agents.ugv.machine import FIXED, TRACK_NAMES, USUAL, UGVTrainConfig, require_ground
from stickslip.dynamics.names import RANDOM_TRACKS
from stickslip.dynamics.ugv import PoseSolver, Track, UGVParams
from stickslip.dynamics.ugv.params import OPTIONAL, vehicle_text
from stickslip.dynamics.ugv.params import UNITS as OF_VEHICLE
from stickslip.envs.tasks.definition import task_by_name
from stickslip.envs.ugv.env import UGVEnv
from stickslip.envs.ugv.params import NUMBERS as RULES
from stickslip.envs.ugv.params import UGVEnvParams
from stickslip.envs.ugv.randomisation import RandomTrack, UGVRandomisation

if TYPE_CHECKING:
    from jaxtyping import PyTree

    from stickslip.agents.sweeps.swept import Swept
    from stickslip.dynamics.pytrees import Number

    UGVTask: TypeAlias = Task[UGVEnv, UGVEnvParams]

LIMITS = ("max_torque",)
"""Numbers of UGVEnvParams, in a task that has them."""
NUMBERS = ("start_angles", *(name for name in RULES if name not in LIMITS))
"""Those of every task."""
GIVEN = ("friction", "leg_rate", "spacing", "preview_length", "preview_noise")
"""Those that a configuration has under the same names."""
SOLVER = PoseSolver(iterations=5, samples=8)
"""Solver in training: unrolled, which suits batches; exact to rounding on such ground."""

UNITS = {
    "task.leg_rate": "rad/m",
    "start_angles": "rad",
    "task.max_torque": "N m",
    "task.speed": "m/s",
    "randomisation.track.roughness": "m^3",
    **{f"vehicle.{name}": unit or "-" for name, unit in OF_VEHICLE.items()},
    **dict.fromkeys(("spacing", "start", "end"), "m"),
    **dict.fromkeys(("min_clearance", "preview_length", "preview_noise"), "m"),
    **dict.fromkeys(("height", "centre", "width", "amplitude", "wavelength"), "m"),
    **dict.fromkeys(("position", "length", "joint", "depth", "side"), "m"),
    **dict.fromkeys(("bump_height", "bump_width", "bump_centre"), "m"),
}
"""Units of numbers that a sweep may vary."""


def ground_by_name(name: str) -> Track | str:
    """The ground in that file, or the name for `make_params`. ValueError listing the names."""
    require_ground(name)
    if name in TRACK_NAMES:
        return name
    from stickslip.optim.posture.track_file import read_track, require_track

    require_track(name, TRACK_NAMES)
    return read_track(Path(name))


def standard_task() -> UGVTask:
    """The task of the default configuration."""
    env, _, tested, _ = training_task(UGVTrainConfig())
    return Task(replace(env, autoreset="disabled"), tested)


def training_task(config: UGVTrainConfig) -> TrainingTask[UGVEnv, UGVEnvParams]:
    """Build the task. ValueError for an unknown ground or numbers that do not go together.

    Tested is the reward in the criterion's unit, from the standard start. A named task is what it
    is; but for a factor on all rewards of training episodes, and what the configuration says of
    their starts and of failing.
    """
    failure = config.failure
    if config.task is not None:
        made, tested = task_by_name(config.task).make("same_step")
        env = cast("UGVEnv", made)
    else:
        env = UGVEnv(config.criterion, config.preview, SOLVER)
        failure = failure or 0.0
        tested = env.make_params(
            track=ground_by_name(config.tracks),
            randomisation=UGVRandomisation(friction=config.random_friction),
            start_angles=(np.radians(config.start_angle),) * 2,
            **tasks.own_machine(UGVParams, "vehicle", config.vehicle),
            **{name: getattr(config, name) for name in GIVEN},
        )
    scale = config.reward_scale or 1 / USUAL[env.criterion]
    changes: Parts = {"reward_scale": scale}
    if failure is not None:
        changes["failure_penalty"] = failure / scale
    if config.random_start is not None:
        angles = tuple(np.radians(config.random_start).tolist())
        changes["randomisation"] = replace(tested.randomisation, start_angles=angles)
    return TrainingTask(env, tested.replace(**changes), tested, tested)


def with_options(task: UGVTask, options: Options, scene: str | None, viewed: bool) -> UGVTask:
    """See Machine; what an option sets is no longer drawn.

    options: vehicle, criterion. scene: a ground.
    """
    given = parts(task.env, task.params)
    numbers, drawn = dict(given["numbers"]), task.params.randomisation
    path = options["vehicle"]
    if path is None and options.get("changes"):
        path = vehicle_text(vars(task.params.vehicle))
    own = tasks.own_machine(UGVParams, "vehicle", path, options.get("changes"))
    given["vehicle"] = own.pop("vehicle", given["vehicle"])
    numbers |= own
    if scene is not None:
        given["track"], drawn = ground_by_name(scene), replace(drawn, track=None)
        numbers |= {"start": None, "end": None, "failure_penalty": None}
    if options["criterion"] is not None:
        given["env"] = replace(task.env, criterion=options["criterion"])
        numbers["failure_penalty"] = None
    env, params = build(**given | {"numbers": numbers, "randomisation": drawn})
    return Task(env, swept().changed(params, options["numbers"]))


def label(task: UGVTask, scene: str | None) -> str:
    """The ground in a word or two, and what else is not as in the standard task."""
    params = task.params
    words = [_ground_words(params) if scene is None or scene in TRACK_NAMES else scene]
    if params.randomisation.friction is not None:
        words.append("random friction")
    elif np.float32(params.friction) != np.float32(UGVTrainConfig.friction):
        words.append(f"mu {float(params.friction):g}")
    if not tasks.same_numbers(params.vehicle, UGVParams()):
        mass = params.vehicle.weight / params.vehicle.gravity
        words.append(f"vehicle of {float(mass):.3g} kg")
    return ", ".join(words)


def _ground_words(params: UGVEnvParams) -> str:
    """The name of a ground where it is that one, else "other" and the kind of its shape."""
    if (drawn := params.randomisation.track) is not None:
        same = (one for one in RANDOM_TRACKS if tasks.same_numbers(RandomTrack.named(one), drawn))
        return next(same, "random")
    same = (one for one in FIXED if tasks.same_numbers(Track.named(one), params.track))
    return next(same, f"other {type(params.track.shape).__name__.lower()}")


def details(task: UGVTask) -> str:
    """The numbers of the task in a line."""
    numbers = parts(task.env, task.params)["numbers"]
    words = tasks.numbers_in_words(numbers, task.params.randomisation)
    criterion = task.env.criterion.replace("_", " ")
    return f"{criterion}, preview of {task.env.preview} points, {words}"


def parts(env: UGVEnv, params: UGVEnvParams) -> Parts:
    """See Machine; the arguments of `build`."""
    limits = [name for name in LIMITS if getattr(params, name) is not None]
    return {
        "env": env,
        "vehicle": params.vehicle,
        "track": params.track,
        "randomisation": params.randomisation,
        "dtype": str(jnp.result_type(params.start)),
        "numbers": {name: getattr(params, name) for name in (*NUMBERS, *limits)},
    }


def build(
    env: UGVEnv,
    vehicle: UGVParams,
    track: Track,
    randomisation: UGVRandomisation,
    dtype: str,
    numbers: Parts,
) -> UGVTask:
    """The task of its parts. ValueError for parts that will not do.

    numbers: None for the default of start, end and failure_penalty.
    """
    tasks.require_numbers(numbers, NUMBERS, LIMITS)
    # Evenly spaced already: rounding must not add a step.
    spaced = {**numbers, "spacing": numbers["spacing"] * (1 + 1e-6)}
    kind, own = jax.dtypes.canonicalize_dtype(dtype), {"vehicle": vehicle, "track": track}
    params = env.make_params(**own, randomisation=randomisation, dtype=kind, **spaced)
    if numbers["start"] is not None:
        kept = ("spacing", "start", "end", "start_angles")
        params = params.replace(**{name: numbers[name] for name in kept})
    return Task(env, params)


def swept() -> Swept:
    """See Machine: numbers of the task, vehicle, track and randomisation."""
    from stickslip.agents.sweeps.swept import Swept

    how = {"parts": swept_parts, "with_parts": with_swept, "opened": opened}
    return Swept(UNITS, aliases={"motor.torque_limit": ("task.max_torque",)}, **how)


def opened(params: UGVEnvParams, names: Collection[str]) -> UGVEnvParams:
    """See Swept: motors without a limit get one, and the vehicle what it does not have."""
    limited = {"max_torque", "task.max_torque", "motor.torque_limit"} & set(names)
    if limited and params.max_torque is None:
        params = params.replace(max_torque=1.0)
    asked = {name.removeprefix("vehicle.") for name in names} & set(OPTIONAL)
    given = {name: 0.5 for name in asked if getattr(params.vehicle, name) is None}
    return params.replace(vehicle=params.vehicle.replace(**given)) if given else params


def swept_parts(params: UGVEnvParams) -> dict[str, PyTree]:
    """See Swept; numbers that are None have no place in the program, and of a ground that is
    drawn, its ranges stand under randomisation."""
    given = {name: getattr(params, name) for name in (*NUMBERS, *LIMITS)}
    return {
        "task": {name: value for name, value in given.items() if value is not None},
        "track": vars(params.track.shape) if params.randomisation.track is None else {},
        "vehicle": vars(params.vehicle),
        "randomisation": params.randomisation,
    }


def with_swept(
    params: UGVEnvParams, parts: Mapping[str, PyTree], values: Mapping[str, Number]
) -> UGVEnvParams:
    """See Swept. What an axis sets is no longer drawn."""
    touched = {name.partition(".")[0] for name in values}
    drawn = parts["randomisation"]
    own = {name.split(".")[1] for name in values if name.startswith("task.")}
    changed: dict[str, PyTree] = {name: parts["task"][name] for name in own}
    drawn = replace(drawn, **dict.fromkeys(own & {"friction", "start_angles"}))
    if "track" in touched:
        shape: PyTree = params.track.shape
        shape = replace(shape, **parts["track"])
        changed["track"] = replace(params.track, shape=shape)
    if "vehicle" in touched:
        changed["vehicle"] = replace(params.vehicle, **parts["vehicle"])
    return params.replace(**changed, randomisation=drawn)
