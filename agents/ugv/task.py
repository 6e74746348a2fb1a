"""Tasks of the UGV: of a configuration, into a policy's file, out of it, changed by options."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, cast

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.machine import TrainingTask
from stickslip.agents.policy.task import numbers_in_words, require_numbers, same_numbers
from stickslip.agents.protocol import Task
from stickslip.agents.ugv.config import FIXED, USUAL, UGVTrainConfig, require_ground
from stickslip.dynamics.ugv import PoseSolver, Track, UGVParams
from stickslip.dynamics.ugv.names import RANDOM_TRACKS
from stickslip.envs.tasks.definition import task_by_name
from stickslip.envs.ugv.env import UGVEnv
from stickslip.envs.ugv.randomisation import RandomTrack, UGVRandomisation

if TYPE_CHECKING:
    from typing import TypeAlias

    from stickslip.agents.machine import Parts
    from stickslip.agents.protocol import Options
    from stickslip.envs.ugv.params import UGVEnvParams

    UGVTask: TypeAlias = Task[UGVEnv, UGVEnvParams]

NUMBERS = (
    "friction",
    "leg_rate",
    "spacing",
    "start",
    "end",
    "start_angles",
    "min_clearance",
    "preview_length",
    "preview_noise",
    "failure_penalty",
    "reward_scale",
    "speed",
)
"""Of UGVEnvParams."""
LIMITS = ("max_torque",)
"""The same, in a task that has them."""
FRICTION = 0.8
"""Of the standard task."""
SOLVER = PoseSolver(iterations=5, samples=8)
"""Of training: unrolled, which suits batches; exact to rounding on such ground."""


class Ground(NamedTuple):
    """A track, and what is drawn in its place for every episode, if anything."""

    track: Track
    drawn: RandomTrack | None = None


def ground_by_name(name: str) -> Ground:
    """The ground of that name, or from the file of that name. ValueError listing the names."""
    require_ground(name)
    if name in RANDOM_TRACKS:
        return Ground(Track.flat(), RandomTrack.named(name))
    if name in FIXED:
        return Ground(Track.named(name))
    from stickslip.optim.posture.track_file import read_track

    return Ground(read_track(Path(name)))


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
    if config.task is not None:
        made, params = task_by_name(config.task).make("same_step")
        env = cast("UGVEnv", made)
        scale = config.reward_scale or 1 / USUAL[env.criterion]
        training = params.replace(reward_scale=scale)
        if config.failure is not None:
            training = training.replace(failure_penalty=config.failure / scale)
        if config.random_start is not None:
            drawn = replace(params.randomisation, start_angles=_radians(config.random_start))
            training = training.replace(randomisation=drawn)
        return TrainingTask(env, training, params, params)
    env = UGVEnv(config.criterion, config.preview, SOLVER)
    ground = ground_by_name(config.tracks)
    start = np.radians(config.start_angle)
    common: Parts = {
        "track": ground.track,
        "friction": config.friction,
        "leg_rate": config.leg_rate,
        "spacing": config.spacing,
        "start_angles": (start, start),
        "preview_length": config.preview_length,
        "preview_noise": config.preview_noise,
    }
    drawn = UGVRandomisation(ground.drawn, config.random_friction)
    tested = env.make_params(randomisation=drawn, **common)
    scale = config.reward_scale or 1 / USUAL[config.criterion]
    if config.random_start is not None:
        drawn = replace(drawn, start_angles=_radians(config.random_start))
    training = env.make_params(
        randomisation=drawn,
        reward_scale=scale,
        failure_penalty=(config.failure or 0.0) / scale,
        **common,
    )
    return TrainingTask(env, training, tested, tested)


def _radians(degrees: tuple[float, float]) -> tuple[float, float]:
    low, high = np.radians(degrees)
    return float(low), float(high)


def with_options(task: UGVTask, options: Options, scene: str | None, viewed: bool) -> UGVTask:
    """See Machine; what an option sets is no longer drawn.

    options: friction, criterion. scene: a ground.
    """
    given = parts(task.env, task.params)
    numbers, drawn = dict(given["numbers"]), task.params.randomisation
    if scene is not None:
        ground = ground_by_name(scene)
        given["track"], drawn = ground.track, replace(drawn, track=ground.drawn)
        numbers |= {"start": None, "end": None, "failure_penalty": None}
    if options["friction"] is not None:
        numbers["friction"], drawn = options["friction"], replace(drawn, friction=None)
    if options["criterion"] is not None:
        given["env"] = replace(task.env, criterion=options["criterion"])
        numbers["failure_penalty"] = None
    return build(**given | {"numbers": numbers, "randomisation": drawn})


def label(task: UGVTask, scene: str | None) -> str:
    """The ground in a word or two, and what else is not as in the standard task."""
    params, words = task.params, [scene or _ground_words(task.params)]
    if params.randomisation.friction is not None:
        words.append("random friction")
    elif np.float32(params.friction) != np.float32(FRICTION):
        words.append(f"mu {float(params.friction):g}")
    if not same_numbers(params.vehicle, UGVParams()):
        mass = params.vehicle.weight / params.vehicle.gravity
        words.append(f"vehicle of {float(mass):.3g} kg")
    return ", ".join(words)


def _ground_words(params: UGVEnvParams) -> str:
    """The name of a ground where it is that one, else the kind of its shape."""
    if (drawn := params.randomisation.track) is not None:
        same = (one for one in RANDOM_TRACKS if same_numbers(RandomTrack.named(one), drawn))
        return next(same, "random")
    same = (one for one in FIXED if same_numbers(Track.named(one), params.track))
    return next(same, type(params.track.shape).__name__.lower())


def details(task: UGVTask) -> str:
    """The numbers of the task in a line."""
    words = numbers_in_words(parts(task.env, task.params)["numbers"], task.params.randomisation)
    criterion = task.env.criterion.replace("_", " ")
    return f"{criterion}, preview of {task.env.preview} points, {words}"


def parts(env: UGVEnv, params: UGVEnvParams) -> Parts:
    """See Machine; the arguments of `build`."""
    numbers = {name: getattr(params, name) for name in NUMBERS}
    limits = {name: getattr(params, name) for name in LIMITS}
    return {
        "env": env,
        "vehicle": params.vehicle,
        "track": params.track,
        "randomisation": params.randomisation,
        "dtype": str(jnp.result_type(params.start)),
        "numbers": numbers | {name: one for name, one in limits.items() if one is not None},
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
    require_numbers(numbers, NUMBERS, LIMITS)
    # Evenly spaced already: rounding must not add a step.
    spaced = {**numbers, "spacing": numbers["spacing"] * (1 + 1e-6)}
    params = env.make_params(
        vehicle=vehicle,
        track=track,
        randomisation=randomisation,
        dtype=jax.dtypes.canonicalize_dtype(dtype),
        **spaced,
    )
    if numbers["start"] is not None:
        kept = ("spacing", "start", "end", "start_angles")
        params = params.replace(**{name: numbers[name] for name in kept})
    return Task(env, params)
