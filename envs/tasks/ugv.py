"""The UGV's tasks. What stands here never changes: another content is another version."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.envs.tasks.definition import TaskDefinition

if TYPE_CHECKING:
    from stickslip.envs.plain import Plain

SOLVER: Plain = {"method": "newton", "iterations": 5, "samples": 8, "overlap": False}
"""Unrolled, which suits batches; exact to rounding on such ground."""
SEARCHING: Plain = {"method": "scan", "samples": 8, "candidates": 64, "overlap": False}
"""Solver for ground that is hollower than a wheel."""
CHOICES: dict[str, Plain] = {"preview": 16, "solver": SOLVER}
NUMBERS: dict[str, Plain] = {
    "friction": 0.8,
    "leg_rate": 1.0,
    "spacing": 0.1,
    "start_angles": [1.5707963267948966, 1.5707963267948966],
    "min_clearance": 0.02,
    "preview_length": 4.0,
    "reward_scale": 1.0,
    "speed": 1.0,
}
"""Defaults of the tasks, written down so that no default elsewhere changes a task."""
LEVEL: Plain = {"flat": {"start": 0.0, "end": 8.0}}
"""Ground that drawn ground replaces."""
BUMPS: dict[str, Plain] = {
    "bump_height": [0.02, 0.2],
    "bump_width": [0.8, 1.6],
    "bump_centre": [3.5, 5.5],
    "pieces": 96,
    "cells": 48,
}
PATCHES: dict[str, Plain] = {
    **BUMPS,
    "grip": [0.3, 1.0],
    "patch_length": [0.5, 1.5],
    "patches": 16,
}
ROUGH: dict[str, Plain] = {"roughness": [16e-6, 1024e-6], "waves": 32, "pieces": 96, "cells": 48}


def _task(
    stem: str, title: str, about: str, unit: str, criterion: str, **content: Plain
) -> TaskDefinition:
    """A task of the UGV with the reference vehicle; names of CHOICES are static choices."""
    choices = CHOICES | {name: content.pop(name) for name in CHOICES if name in content}
    choices |= {name: content.pop(name) for name in ("see_friction",) if name in content}
    choices["criterion"] = criterion
    parameters = NUMBERS | content
    return TaskDefinition(stem, title, about, "ugv", "UGVEnv", parameters, choices, unit, version=1)


STEMS = ("UGVBump", "UGVDitch", "UGVRandomBumps", "UGVRough", "UGVLowGrip", "UGVPatchyGrip")
UGV_WITHDRAWN: dict[str, str] = {
    f"{stem}-v0": "nothing kept its wheels from standing in each other" for stem in STEMS
}
"""Reasons of withdrawn versions, by name."""
UGV_TASKS = (
    _task(
        "UGVBump",
        "over the chapter's bump with the least work of all motors",
        "Wheels and legs count alike, so that a leg moves where it saves the wheels more than it "
        "takes. The ground is always the same.",
        "J",
        "total_energy",
        track={"bump": {"height": 0.1, "centre": 4.0, "width": 1.0, "start": 0.0, "end": 8.0}},
    ),
    _task(
        "UGVDitch",
        "through a ditch hollower than a wheel with the least work of all motors",
        "8 cm deep; where the sides end the ground is hollower than a wheel, which touches it "
        "twice. The ground is always the same.",
        "J",
        "total_energy",
        solver=SEARCHING,
        track={
            "ditch": {
                "depth": 0.08,
                "position": 4.0,
                "width": 1.2,
                "side": 0.35,
                "start": 0.0,
                "end": 8.0,
            }
        },
    ),
    _task(
        "UGVRandomBumps",
        "over bumps of 2 to 20 cm with the least work of the wheels",
        "Height, width and place are drawn; 16 points of the next 4 m are seen.",
        "J",
        "wheel_energy",
        randomisation={"track": BUMPS},
        track=LEVEL,
    ),
    _task(
        "UGVRough",
        "with the most constant torque over rough ground seen badly",
        "Classes A to D of ISO 8608; every height ahead carries an error of 1 cm, new in each "
        "step. The cost is the integral of (dM/dx)^2.",
        "N^2 m",
        "torque_variation",
        randomisation={"track": ROUGH},
        track=LEVEL,
        preview_noise=0.01,
    ),
    _task(
        "UGVLowGrip",
        "with the most grip to spare over bumps on slippery ground",
        "Friction is drawn from 0.3 to 0.5. The return is the least mu N - |F| of both wheels on "
        "the whole way: one bad place decides.",
        "N",
        "grip",
        randomisation={"track": BUMPS, "friction": [0.3, 0.5]},
        track=LEVEL,
    ),
    _task(
        "UGVPatchyGrip",
        "with the most grip to spare over bumps on ground that is slippery in places",
        "Each patch, 0.5 to 1.5 m long, has a friction of its own, from 0.15 to 0.5; heights and "
        "frictions of the next 4 m are seen. One wheel stands on ice while the other does not.",
        "N",
        "grip",
        see_friction=True,
        friction=0.5,
        randomisation={"track": PATCHES},
        track=LEVEL,
    ),
)
