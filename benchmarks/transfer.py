"""How much of a score survives in MuJoCo: the package's policies on the biped's tasks.

    python -m benchmarks.transfer [--quick] [--update] [--out FILE]

The motion is computed here, in MuJoCo, and there without contact of the swinging foot. --update
also writes the table of docs/performance.md. About a minute of processor time a task.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.report import markdown, measured_by_command, put_between, where
from stickslip.agents import evaluate, load_policy
from stickslip.agents.evaluation.rollout import is_random
from stickslip.agents.exchange.mujoco_env import moved_by
from stickslip.agents.policy.shipped import policy_name
from stickslip.envs import BipedEnv
from stickslip.envs.tasks import TASKS
from stickslip.envs.tasks.known import known_of

EPISODES = 8
DOCUMENT = Path("docs/performance.md")


def transfer_rows(quick: bool) -> Iterator[dict[str, Any]]:
    """Scores with half their intervals in the three places, and the episodes that fall in each."""
    for task in TASKS.values():
        env, params = task.make("disabled")
        known = known_of(task)
        if not isinstance(env, BipedEnv) or known is None:
            continue
        seeds = range((1 if quick else EPISODES) if is_random(params) else 1)
        name, inside = policy_name(task.name), moved_by(env, "mujoco")
        places = {"score here": env, "in MuJoCo": inside}
        places["no swing contact"] = replace(inside, swing_contact=False)
        row: dict[str, Any] = {"task": task.name, "episodes": len(seeds)}
        falls = []
        for place, own in places.items():
            scenes = {task.name: params}
            table = evaluate(own, {name: load_policy(name)}, scenes, episodes=len(seeds))
            played = table.rows[0].episodes
            row[place] = known.score(played.reward, seeds).shown(2)
            falls.append(f"{np.sum(played.fell):d}")
        row["falls"] = ", ".join(falls)
        yield row


def update(content: dict[str, Any]) -> None:
    """Write the page's table."""
    text = f"Measured on {where(content)}.\n\n{markdown(content['transfer'])}"
    put_between(DOCUMENT, text, "transfer")


if __name__ == "__main__":
    measured_by_command("transfer", __doc__, {"transfer": transfer_rows}, update)
