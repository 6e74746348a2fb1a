"""A task of the UGV in parts: into a policy's file, out of it again, changed by options."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.tasks.file import plain, rebuilt_task, same_numbers, task_entry
from stickslip.agents.ugv.config import UGVTrainConfig
from stickslip.agents.ugv.tracks import FIXED, RANDOM, ground_by_name
from stickslip.agents.ugv.training import make_ugv_task
from stickslip.agents.untrusted import Rule
from stickslip.dynamics.ugv import Track, UGVParams
from stickslip.envs.ugv.env import UGVEnv
from stickslip.envs.ugv.randomisation import UGVRandomisation

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.agents.machine import Options
    from stickslip.agents.untrusted import Json
    from stickslip.envs.ugv.params import UGVEnvParams

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
PARTS = ("env", "vehicle", "track", "randomisation", "dtype", "numbers")
FRICTION = 0.8
"""Of the standard task."""
KNOWN_OF_OLD = ("leg_rate", "spacing", "preview_length", "preview_noise")
"""Numbers that files without a whole task tell of."""


class UGVParts(NamedTuple):
    """Arguments of `UGVEnv.make_params`."""

    env: UGVEnv
    vehicle: UGVParams
    track: Track
    randomisation: UGVRandomisation
    dtype: str
    numbers: dict[str, Any]
    """By the names of NUMBERS, and of LIMITS where there are any; None for the default of start,
    end and failure_penalty."""

    @classmethod
    def of(cls, env: UGVEnv, params: UGVEnvParams) -> UGVParts:
        """The parts of a task."""
        numbers = {name: getattr(params, name) for name in NUMBERS}
        limits = {name: getattr(params, name) for name in LIMITS}
        numbers |= {name: limit for name, limit in limits.items() if limit is not None}
        dtype = str(jnp.result_type(params.start))
        return cls(env, params.vehicle, params.track, params.randomisation, dtype, numbers)

    def params(self) -> UGVEnvParams:
        """The environment's parameters. ValueError for parts that will not do."""
        # Evenly spaced already: rounding must not add a step.
        numbers = self.numbers | {"spacing": self.numbers["spacing"] * (1 + 1e-6)}
        params = self.env.make_params(
            vehicle=self.vehicle,
            track=self.track,
            randomisation=self.randomisation,
            dtype=jax.dtypes.canonicalize_dtype(self.dtype),
            **numbers,
        )
        if self.numbers["start"] is None:
            return params
        kept = ("spacing", "start", "end", "start_angles")
        return params.replace(**{name: self.numbers[name] for name in kept})

    def with_options(self, options: Options, scene: str | None) -> UGVParts:
        """The task with what options ask for instead; what one of them sets is no longer drawn.

        options: friction, criterion, each None where it is not given. scene: a ground.
        """
        task, numbers, drawn = self, dict(self.numbers), self.randomisation
        if scene is not None:
            ground = ground_by_name(scene)
            drawn = replace(drawn, track=ground.drawn)
            task = task._replace(track=ground.track)
            numbers |= {"start": None, "end": None, "failure_penalty": None}
        if options["friction"] is not None:
            numbers["friction"], drawn = options["friction"], replace(drawn, friction=None)
        if options["criterion"] is not None:
            task = task._replace(env=replace(task.env, criterion=options["criterion"]))
            numbers["failure_penalty"] = None
        return task._replace(randomisation=drawn, numbers=numbers)

    def label(self, scene: str | None) -> str:
        """The ground in a word or two, and what else is not as in the standard task."""
        words = [scene or ground_words(self)]
        if self.randomisation.friction is not None:
            words.append("random friction")
        elif np.float32(self.numbers["friction"]) != np.float32(FRICTION):
            words.append(f"mu {float(self.numbers['friction']):g}")
        if not same_numbers(self.vehicle, UGVParams()):
            words.append(f"vehicle of {float(self.vehicle.weight / self.vehicle.gravity):.3g} kg")
        return ", ".join(words)

    def details(self) -> str:
        """The numbers of the task in a line."""
        words = [self.env.criterion, f"preview of {self.env.preview} points"]
        for name, value in self.numbers.items():
            if value is not None and name != "start_angles":
                words.append(f"{name} {float(value):.4g}")
        ends = self.randomisation.friction
        if ends is not None:
            words.append(f"friction drawn from {float(ends[0]):.4g} to {float(ends[1]):.4g}")
        return ", ".join(words).replace("_", " ")


def describe_ugv(env: UGVEnv, params: UGVEnvParams) -> dict[str, Json]:
    """The configuration of an environment as JSON values, for a policy's metadata: for people, and
    in parts for `read_task`."""
    task, ranges = UGVParts.of(env, params), params.randomisation
    drawn = None if ranges.track is None else plain(vars(ranges.track))
    return {
        "environment": type(env).__name__,
        "choices": {name: plain(value) for name, value in asdict(env).items()},
        "track": type(params.track.shape).__name__,
        "randomisation": plain(vars(ranges) | {"track": drawn}),
        "vehicle": plain(vars(params.vehicle)),
        "observation_size": len(env.observation_bounds(params)[0]),
        **{name: plain(value) for name, value in task.numbers.items()},
        **task_entry(**task._asdict()),
    }


def read_task(metadata: Mapping[str, Json]) -> UGVParts | None:
    """The task in a policy's metadata; None where there is none. ValueError for a damaged one."""
    kinds = {"env": UGVEnv, "vehicle": UGVParams, "track": Track} | {
        "randomisation": UGVRandomisation
    }
    return rebuilt_task(metadata, UGVParts, PARTS, kinds, NUMBERS, LIMITS)


def standard_task(metadata: Mapping[str, Json]) -> UGVParts:
    """The standard task, with what a policy's file tells of: criterion, preview, some numbers."""
    choices = metadata.get("choices")
    known = choices if isinstance(choices, dict) else {}
    asked = {name: known[name] for name in ("criterion", "preview") if name in known}
    asked |= {name: metadata[name] for name in KNOWN_OF_OLD if name in metadata}
    if "spacing" in asked:
        asked["spacing"] = Rule(float, "way of a step", low=0).require("spacing", asked["spacing"])
        asked["spacing"] *= 1 + 1e-6
    task = make_ugv_task(UGVTrainConfig.of(**asked))
    return UGVParts.of(replace(task.env, autoreset="disabled"), task.test)


def ground_words(task: UGVParts) -> str:
    """The name of a ground where it is that one, else the kind of its shape."""
    drawn = task.randomisation.track
    if drawn is not None:
        return next((name for name, one in RANDOM.items() if same_numbers(one, drawn)), "random")
    for name in FIXED:
        if same_numbers(Track.named(name), task.track):
            return name
    return type(task.track.shape).__name__.lower()
