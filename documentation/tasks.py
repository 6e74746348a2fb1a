"""Pictures of the tasks for docs/tasks.md: `python -m documentation.tasks`."""

from __future__ import annotations

from pathlib import Path

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
    "UGVBump-v1": 0.5,
    "UGVDitch-v1": 0.5,
    "UGVRandomBumps-v1": 0.5,
    "UGVRough-v1": 0.6,
    "UGVLowGrip-v1": 0.5,
    "UGVPatchyGrip-v1": 0.5,
    "UGVRoughGrip-v0": 0.5,
}
"""Time in a biped's episode [s], share of a UGV's drive."""


def draw(name: str, moment: float) -> Path:
    """Draw the package's policy for a task at a moment of an episode; return the file."""
    env, params = TASKS[name].make("disabled")
    played = rollout(env, load_policy(policy_name(name)), params, SEED).trimmed()
    biped = name.startswith("Biped")
    step = round(moment / float(params.control_period) if biped else moment * int(played.length))
    picture = env.pictures(*samples(played), params)(step)
    path = FOLDER / f"{name}.png"
    Image.fromarray(picture).quantize(128).save(path, optimize=True)
    return path


if __name__ == "__main__":
    for task, moment in MOMENTS.items():
        print(draw(task, moment))
