"""Pictures of the tasks for docs/tasks.md: `python -m documentation.tasks`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from stickslip.agents import load_policy
from stickslip.agents.evaluation.rollout import rollout
from stickslip.agents.pictures.episodes import samples
from stickslip.agents.policy.shipped import policy_name
from stickslip.envs import TASKS

FOLDER = Path(__file__).parents[1] / "docs" / "tasks"
SEED = 2**31
"""Of the episode: the first one that evaluations use."""
MOMENTS = {
    "BipedSteady-v0": 2.0,
    "BipedIce-v0": 2.5,
    "BipedRobots-v0": 2.0,
    "UGVBump-v1": 0.5,
    "UGVDitch-v1": 0.5,
    "UGVRandomBumps-v1": 0.5,
    "UGVRough-v1": 0.6,
    "UGVLowGrip-v1": 0.5,
    "UGVPatchyGrip-v1": 0.5,
    "UGVRoughGrip-v0": 0.5,
}
"""Time in a biped's episode [s], share of a UGV's drive."""
BESIDE, MIDDLE = 4, np.s_[60:, 280:700]
"""Robots that are shown side by side, and what is shown of each picture."""


def draw(name: str, moment: float) -> Path:
    """Draw the package's policy for a task at a moment of an episode; return the file."""
    picture = frame(name, moment, SEED)
    if name.startswith("BipedRobots"):
        several = (frame(name, moment, SEED + k)[MIDDLE] for k in range(BESIDE))
        picture = np.concatenate(list(several), axis=1)
    path = FOLDER / f"{name}.png"
    Image.fromarray(picture).quantize(128).save(path, optimize=True)
    return path


def frame(name: str, moment: float, seed: int) -> np.ndarray:
    """The picture of a moment of the seed's episode."""
    env, params = TASKS[name].make("disabled")
    played = rollout(env, load_policy(policy_name(name)), params, seed).trimmed()
    biped = name.startswith("Biped")
    step = round(moment / float(params.control_period) if biped else moment * int(played.length))
    return env.pictures(*samples(played), params)(step)


if __name__ == "__main__":
    for task, moment in MOMENTS.items():
        print(draw(task, moment))
