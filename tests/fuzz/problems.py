"""Vehicles, grounds, pose solvers, problems and configurations."""

from __future__ import annotations

from stickslip import optim
from stickslip.agents.biped.config import TrainConfig
from stickslip.agents.training.configuration import every_field
from stickslip.dynamics import ugv
from tests.fuzz.robots import bare
from tests.fuzz.values import (
    ABOVE,
    ANY_ONE,
    ANYTHING,
    CHOICE,
    FLAG,
    INTEGER,
    KIND,
    NOT_BELOW,
    REAL,
    Plan,
    maybe,
)

VEHICLE = dict.fromkeys(
    ("body_length", "leg_length", "wheel_radius", "gravity"), ABOVE
) | dict.fromkeys(
    ("wheel_mass", "body_mass", "leg_mass", "leg_angle_min", "leg_angle_max", "wheel_gap"),
    NOT_BELOW,
)  # fmt: skip
GROUND = {"start": REAL, "end": REAL}


def problems() -> dict[str, Plan]:
    """All but gaits."""
    bump = {**GROUND, "height": REAL, "width": ABOVE, "centre": REAL}
    config = dict.fromkeys((one.name for one in every_field(TrainConfig)), ANYTHING)
    problem = optim.PostureProblem
    return {
        "UGVParams": Plan(ugv.UGVParams, VEHICLE),
        "UGVParams.replace": Plan(ugv.UGVParams().replace, VEHICLE),
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
                "overlap": FLAG,
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
    }


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
