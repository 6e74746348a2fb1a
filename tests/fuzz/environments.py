"""Environments, their parameters, what is drawn for an episode, and adapters."""

from __future__ import annotations

from functools import lru_cache

from stickslip import envs
from stickslip.dynamics import ugv
from tests.extras import MISSING
from tests.fuzz.values import (
    ABOVE,
    ANY_ONE,
    BATCHES,
    CHOICE,
    FLAG,
    INTEGER,
    KIND,
    NOT_BELOW,
    ONE,
    RANGE,
    Plan,
    maybe,
)

WALK_NUMBERS = dict.fromkeys(
    ("torque_limit", "control_period", "mean_rate", "time_limit", "max_crank_rate"), ABOVE
) | dict.fromkeys(
    ("copper_loss", "tracking_weight", "slip_weight", "energy_weight", "fall_penalty"), NOT_BELOW
)  # fmt: skip
WALK = WALK_NUMBERS | {
    "mark": maybe(*ABOVE), "mark_width": maybe(*ABOVE),
    "robot": ("none",), "scene": ("none",), "randomisation": ("none",), "dtype": ("none", "type"),
}  # fmt: skip
DRIVE = dict.fromkeys(("leg_rate", "preview_length", "reward_scale", "speed"), ABOVE) | {
    "vehicle": ("none",), "track": ("none",), "randomisation": ("none",),
    "dtype": ("none", "type"), "friction": NOT_BELOW, "min_clearance": NOT_BELOW,
    "preview_noise": maybe(*NOT_BELOW), "failure_penalty": maybe(*NOT_BELOW),
    "max_torque": maybe(*ABOVE),
    "spacing": ONE, "start": maybe(*ANY_ONE), "end": maybe(), "start_angles": ("pair",),
}  # fmt: skip

HAS_SB3 = "stable_baselines3" not in MISSING


@lru_cache
def walker() -> envs.BipedEnvParams:
    return envs.BipedEnv().make_params()


@lru_cache
def driver() -> envs.UGVEnvParams:
    return envs.UGVEnv().make_params()


def environments() -> dict[str, Plan]:
    """Of both machines."""
    made = envs.BipedEnv
    return {
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
            dict.fromkeys(("friction", "mass", "payload", "mean_rate", "crank_rate"), RANGE)
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
    } | (of_sb3() if HAS_SB3 else {})


def of_sb3() -> dict[str, Plan]:
    return {
        "SB3VecEnv": Plan(
            lambda **k: envs.SB3VecEnv(**{"params": walker(), **k}),
            {
                "env": KIND,
                "params": KIND,
                "num_envs": INTEGER,
                "seed": INTEGER,
                "render_mode": ("none",),
            },
            {"env": envs.BipedEnv(autoreset="same_step"), "num_envs": 1},
            of=envs.SB3VecEnv,
        ),
    }
