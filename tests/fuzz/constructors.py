"""Every public call that takes a user's numbers, what each argument accepts, and bad values."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from stickslip import envs, optim
from stickslip.agents.biped.config import TrainConfig
from stickslip.agents.training.configuration import every_field
from stickslip.dynamics import Grip, Patches, Scene, Smoothed, Status, Uniform, biped, ugv
from stickslip.dynamics.biped.boundary import require_kinds

BAD: dict[str, Any] = {
    "huge": 10**400,
    "minus huge": -(10**400),
    "overflow": 1e39,
    "nan": np.nan,
    "inf": np.inf,
    "-inf": -np.inf,
    "minus one": -1.0,
    "half": 0.5,
    "subnormal": 1e-320,
    "true": True,
    "none": None,
    "text": "1.0",
    "word": "nonsense",
    "bytes": b"1",
    "complex": 1j,
    "empty list": [],
    "list of none": [None],
    "ragged": [[1.0], [1.0, 2.0]],
    "pair": (1.0, 2.0),
    "dict": {},
    "set": {1.0},
    "object": object(),
    "type": float,
    "function": lambda: 1.0,
    "array of text": np.asarray(["a"]),
    "array of objects": np.asarray([None]),
    "empty array": np.zeros(0),
    "other shape": np.ones((2, 3)),
    "date": np.datetime64("2020-01-01"),
}

REAL = ("minus one", "half", "subnormal", "pair", "other shape")
ABOVE = ("half", "pair", "other shape")
NOT_BELOW = ("half", "subnormal", "pair", "other shape")
ONE = ("half",)
HAND = ("half", "other shape")
BATCHES = ("pair", "other shape")
"""Legitimate for a robot, too; each would compile dozens of programs."""
ANY_ONE = ("minus one", "half", "subnormal")
INTEGER = CHOICE = KIND = ()
FLAG = ("true",)
RANGE = ("pair", "none")
ANYTHING = ("half", "subnormal", "overflow", "true", "none", "pair", "text", "word")


def maybe(*accepted: str) -> tuple[str, ...]:
    """The same, or None."""
    return (*accepted, "none")


class Plan(NamedTuple):
    """A call, what each of its arguments accepts out of BAD, and what the others are."""

    call: Callable[..., Any]
    accepts: dict[str, tuple[str, ...]]
    base: dict[str, Any] = {}  # noqa: RUF012
    says: dict[str, str] = {}  # noqa: RUF012
    """The word for an argument in messages, where it is not its name."""
    skips: tuple[str, ...] = ()
    """Values that are not tried, as each is legitimate and a program of its own."""
    of: Callable[..., Any] | None = None
    """What has the signature, where `call` is a lambda around it."""


@lru_cache
def model() -> biped.BipedModel:
    return biped.prepare(biped.BipedParams.from_bars())


@lru_cache
def walker() -> envs.BipedEnvParams:
    return envs.BipedEnv().make_params()


@lru_cache
def driver() -> envs.UGVEnvParams:
    return envs.UGVEnv().make_params()


@lru_cache
def bare() -> biped.BipedParams:
    return biped.BipedParams.from_bars()


def at_boundary(**parts: Any) -> None:
    """What the next call makes of a scene or a state that was put together by hand."""
    state = parts.get("state", biped.BipedState())
    require_kinds(bare(), parts.get("scene", Scene.grip()), state)
    state.validate()


OPTIONS = {"payload": maybe(*NOT_BELOW), "steps": CHOICE, "outputs": CHOICE}
BARS = dict.fromkeys(
    ("crank_length", "gravity", "ground_link", "rod", "rod_pin", "rocker", "tendon_drop",
     "upper_tendon", "lower_tendon", "femur", "femur_pin", "tibia", "tibia_pin", "stabiliser"),
    ABOVE,
) | dict.fromkeys(
    ("bar_density", "hip_mass", "foot_mass", "foot_inertia", "offset", "payload", "heel", "toe",
     "slot_depth", "hip_span"),
    NOT_BELOW,
) | {"hip_centre": ("pair",), "dtype": ("none", "type")}  # fmt: skip
STATE = dict.fromkeys(("crank_rate", "foot_position", "foot_velocity", "time"), REAL)
STATE |= {"phase": (), "steps": ("minus one", "pair", "other shape")}
WALK_NUMBERS = dict.fromkeys(
    ("torque_limit", "control_period", "commanded_rate", "time_limit", "max_crank_rate"), ABOVE
) | dict.fromkeys(
    ("copper_loss", "tracking_weight", "slip_weight", "energy_weight", "fall_penalty"), NOT_BELOW
)  # fmt: skip
WALK = WALK_NUMBERS | {
    "mark": maybe(*ABOVE), "mark_width": maybe(*ABOVE),
    "biped": ("none",), "scene": ("none",), "randomisation": ("none",), "dtype": ("none", "type"),
}  # fmt: skip
DRIVE = dict.fromkeys(("leg_rate", "preview_length", "reward_scale", "speed"), ABOVE) | {
    "vehicle": ("none",), "track": ("none",), "randomisation": ("none",),
    "dtype": ("none", "type"), "friction": NOT_BELOW, "min_clearance": NOT_BELOW,
    "preview_noise": maybe(*NOT_BELOW), "failure_penalty": maybe(*NOT_BELOW),
    "max_torque": maybe(*ABOVE),
    "spacing": ONE, "start": maybe(*ANY_ONE), "end": maybe(), "start_angles": ("pair",),
}  # fmt: skip
VEHICLE = dict.fromkeys(
    ("body_length", "leg_length", "wheel_radius", "gravity"), ABOVE
) | dict.fromkeys(
    ("wheel_mass", "body_mass", "leg_mass", "leg_angle_min", "leg_angle_max"), NOT_BELOW
)  # fmt: skip
STEP = {"params": KIND, "scene": KIND, "state": KIND, "torque": ANY_ONE, "dt": ("half",)}
MARKED = ("nan", "inf", "-inf", "overflow")
"""What a step marks by its status, traced or not."""
HOW = {"fidelity": CHOICE, "integrator": CHOICE}
GROUND = {"start": REAL, "end": REAL}
SOUND_STEP = {"scene": Scene.grip(), "state": biped.BipedState(), "torque": 0.5, "dt": 0.5}


def with_model(function: Callable[..., Any]) -> Callable[..., Any]:
    return lambda **given: function(**{"params": model(), **given})


def one_step(**given: Any) -> None:
    """A step; a torque that is no number in single precision must come out marked. NumPy warns of
    one that is a number in double precision only."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        _, contact = biped.step(**{"params": model(), **given})
    sound = abs(given["torque"]) < float(np.finfo(np.float32).max)
    assert (contact.status == Status.NON_FINITE) == (not sound)


def plans() -> dict[str, Plan]:
    """By the name of what is called."""
    step = SOUND_STEP
    grip, uniform, made = Scene.grip, Scene.uniform, envs.BipedEnv
    return {
        "Scene.grip": Plan(grip, OPTIONS),
        "Scene.uniform": Plan(
            uniform,
            OPTIONS | {"mu_static": NOT_BELOW, "mu_kinetic": maybe(*NOT_BELOW)},
            {"mu_static": 0.5},
        ),
        "Scene.smoothed": Plan(
            Scene.smoothed,
            OPTIONS | {"mu_kinetic": NOT_BELOW, "slip_speed": ABOVE},
            {"mu_kinetic": 0.5},
        ),
        "Scene.patches": Plan(
            Scene.patches,
            OPTIONS | {"edges": ("pair",), "mu_static": ("pair",), "mu_kinetic": ("none",)},
            {"edges": [0.1], "mu_static": [0.5, 0.5]},
        ),
        "Scene": Plan(
            lambda **k: at_boundary(scene=Scene(**k)), OPTIONS | {"floor": ()}, {"floor": Grip()}
        ),
        "Uniform": Plan(
            lambda **k: at_boundary(scene=Scene(Uniform(**k))),
            {"mu_static": HAND, "mu_kinetic": (*HAND, "subnormal")},
            {"mu_static": 1.0, "mu_kinetic": 0.5},
        ),
        "Smoothed": Plan(
            lambda **k: at_boundary(scene=Scene(Smoothed(**k))),
            {"mu_kinetic": (*HAND, "subnormal"), "slip_speed": HAND},
            {"mu_kinetic": 0.5, "slip_speed": 0.1},
        ),
        "Patches": Plan(
            lambda **k: at_boundary(scene=Scene(Patches(**k))),
            {"edges": (), "mu_static": (), "mu_kinetic": ()},
            {"edges": np.asarray([0.1]), "mu_static": np.ones(2), "mu_kinetic": np.ones(2)},
        ),
        "BipedParams.from_bars": Plan(biped.BipedParams.from_bars, BARS, skips=BATCHES),
        "BipedParams.replace": Plan(
            lambda **k: bare().replace(**k),
            {name: BARS.get(name, ()) for name in biped.BipedParams.__dataclass_fields__},
            skips=BATCHES,
        ),
        "BipedState": Plan(lambda **k: at_boundary(state=biped.BipedState(**k)), STATE),
        "prepare": Plan(
            biped.prepare,
            {"params": KIND, "fidelity": CHOICE, "payload": maybe(*NOT_BELOW)},
            {"params": bare()},
        ),
        "BipedModel": Plan(
            biped.BipedModel,
            {"bare": KIND, "fidelity": CHOICE, "payload": maybe(*NOT_BELOW), "load": ("none",)},
            {"bare": bare()},
        ),
        "step": Plan(one_step, STEP | HOW | {"torque": (*ANY_ONE, *MARKED)}, step, of=biped.step),
        "simulate": Plan(
            with_model(biped.simulate),
            STEP | HOW | {"duration": ONE},
            step | {"duration": 0.5},
            skips=("function", "type"),
            of=biped.simulate,
        ),
        "simulate_inverse": Plan(
            with_model(biped.simulate_inverse),
            {name: of for name, of in STEP.items() if name != "torque"}
            | HOW
            | {"crank_acceleration": ANY_ONE, "duration": ONE},
            {k: v for k, v in step.items() if k != "torque"}
            | {"duration": 0.5, "crank_acceleration": 0.0},
            skips=("function", "type"),
            of=biped.simulate_inverse,
        ),
        **{
            name: Plan(getattr(biped, name), {"substeps": INTEGER, "record_events": FLAG})
            for name in ("Euler", "SemiImplicitEuler", "RK4")
        },
        "RK4Split": Plan(
            biped.RK4Split, {"substeps": INTEGER, "max_events": INTEGER, "record_events": FLAG}
        ),
        "EventExact": Plan(
            biped.EventExact,
            {"rtol": (), "atol": (), "max_steps": INTEGER, "max_turn": ONE, "record_events": FLAG},
        ),
        "Table": Plan(biped.Table, {"pieces": INTEGER, "degree": INTEGER}),
        "Chebyshev": Plan(biped.Chebyshev, {"degree": INTEGER}),
        "Paper": Plan(biped.Paper, {"step": ONE}),
        "UGVParams": Plan(ugv.UGVParams, VEHICLE),
        "UGVParams.replace": Plan(ugv.UGVParams().replace, VEHICLE),
        "BipedEnv": Plan(
            made,
            {
                "setting": ("none",),
                "fidelity": CHOICE,
                "substeps": INTEGER,
                "max_events": INTEGER,
                "autoreset": CHOICE,
                "see_friction": FLAG,
                "see_patch": FLAG,
            },
        ),
        "UGVEnv": Plan(
            envs.UGVEnv,
            {
                "criterion": CHOICE,
                "preview": INTEGER,
                "solver": KIND,
                "autoreset": CHOICE,
                "see_friction": FLAG,
            },
        ),
        "BipedEnv.make_params": Plan(made().make_params, WALK),
        "UGVEnv.make_params": Plan(envs.UGVEnv().make_params, DRIVE),
        "BipedEnvParams.replace": Plan(
            lambda **k: walker().replace(**k),
            WALK_NUMBERS
            | {
                "scene": (),
                "randomisation": (),
                "robot": (),
                "biped": ("none",),
                "fidelity": ("none",),
                "dtype": ("none", "type"),
            },
        ),
        "UGVEnvParams.replace": Plan(
            lambda **k: driver().replace(**k),
            {name: of for name, of in DRIVE.items() if name != "dtype"}
            | {
                "vehicle": (),
                "track": (),
                "randomisation": (),
                "odometer": (),
                "start": (*ANY_ONE, *BATCHES),
                "end": (),
                "spacing": ABOVE,
            },
        ),
        "Randomisation": Plan(
            lambda **k: envs.Randomisation(**k).validate(),
            dict.fromkeys(("friction", "mass", "payload", "commanded_rate", "crank_rate"), RANGE)
            | {"phase": ("none",), "command_interval": ("none",), "mark": RANGE},
        ),
        "UGVRandomisation": Plan(
            lambda **k: envs.UGVRandomisation(**k).validate(ugv.UGVParams()),
            {"track": ("none",), "friction": RANGE, "start_angles": RANGE},
        ),
        "RandomTrack": Plan(
            lambda **k: envs.RandomTrack(**k).validate(),
            {
                "bump_height": RANGE,
                "bump_width": ("pair",),
                "bump_centre": ("pair",),
                "roughness": RANGE,
                "waves": INTEGER,
                "pieces": INTEGER,
                "cells": INTEGER,
                "grip": ("none",),
                "patch_length": ("none",),
                "patches": INTEGER,
            },
            {"roughness": (1e-4, 1e-3)},
        ),
        "GymEnv": Plan(
            lambda **k: envs.GymEnv(**{"params": walker(), **k}),
            {"env": KIND, "params": KIND, "render_mode": ("none",)},
            {"env": made(autoreset="disabled")},
            of=envs.GymEnv,
        ),
        "GymVectorEnv": Plan(
            lambda **k: envs.GymVectorEnv(**{"params": walker(), **k}),
            {
                "env": KIND,
                "params": KIND,
                "num_envs": INTEGER,
                "autoreset_mode": CHOICE,
                "render_mode": ("none",),
            },
            {"env": made(), "num_envs": 1},
            of=envs.GymVectorEnv,
        ),
        "SB3VecEnv": Plan(
            lambda **k: envs.SB3VecEnv(**{"params": walker(), **k}),
            {
                "env": KIND,
                "params": KIND,
                "num_envs": INTEGER,
                "seed": INTEGER,
                "render_mode": ("none",),
            },
            {"env": made(autoreset="same_step"), "num_envs": 1},
            of=envs.SB3VecEnv,
        ),
    } | others()


def others() -> dict[str, Plan]:
    """Grounds, pose solvers, problems and configurations."""
    bump = {**GROUND, "height": REAL, "width": ABOVE, "centre": REAL}
    config = dict.fromkeys((one.name for one in every_field(TrainConfig)), ANYTHING)
    problem = optim.PostureProblem
    return {
        "Track.bump": Plan(ugv.Track.bump, bump),
        "Track.flat": Plan(ugv.Track.flat, GROUND),
        "Track.from_points": Plan(
            ugv.Track.from_points,
            {"x": ("pair",), "y": ("pair",), "interpolation": CHOICE},
            {"x": [0.0, 1.0], "y": [0.0, 0.0]},
        ),
        "Surface.patches": Plan(
            ugv.Surface.patches,
            {"edges": (), "factors": ("pair",), "ramp": ("half", "subnormal")},
            {"edges": [1.0], "factors": [1.0, 0.5]},
        ),
        "PoseSolver": Plan(
            ugv.PoseSolver,
            {
                "method": CHOICE,
                "tolerance": maybe("half"),
                "iterations": maybe(),
                "samples": (),
                "candidates": INTEGER,
            },
        ),
        "PostureProblem.along": Plan(
            problem.along,
            {
                "params": ("none",),
                "track": KIND,
                "spacing": ("half", "overflow"),
                "criterion": CHOICE,
                "start": maybe(*ANY_ONE),
                "end": maybe(),
                "friction": ("half", "subnormal", "overflow"),
                "leg_rate": maybe("half", "overflow"),
                "min_normal": ("half", "subnormal", "overflow"),
                "min_grip": ("half", "subnormal", "overflow"),
                "min_clearance": ("half", "subnormal", "overflow"),
                "max_torque": maybe("half", "subnormal", "overflow"),
                "start_angles": maybe("pair"),
                "end_angles": maybe("pair"),
                "solver": KIND,
            },
            {"params": ugv.UGVParams(), "track": ugv.Track.bump(), "spacing": 0.5},
        ),
        "TrainConfig.of": Plan(TrainConfig.of, config),
    } | gaits()


def gaits() -> dict[str, Plan]:
    """Gaits, periodic and from one rate to another."""
    any_above = maybe("half", "subnormal", "overflow")
    shared = {
        "params": KIND,
        "objective": CHOICE,
        "mu": any_above,
        "torque_limit": any_above,
        "mean_rate": any_above,
        "min_normal": ("half", "subnormal", "overflow"),
        "zmp": FLAG,
        "max_rate": any_above,
        "copper_loss": ("half", "subnormal", "overflow"),
        "steps": INTEGER,
    }
    rates = {"start_rate": any_above, "end_rate": any_above}
    return {
        "GaitProblem.periodic": Plan(optim.GaitProblem.periodic, shared, {"params": bare()}),
        "GaitProblem.transfer": Plan(
            optim.GaitProblem.transfer,
            {"steps_taken": INTEGER, **shared, **rates},
            {"params": bare(), "steps_taken": 1},
        ),
    }
