"""What policies earn on a task, over the episodes of seeds 0, 1, ..."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.tasks.recipes import recipe_of
from stickslip.agents.biped.names import STOPPING
from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.evaluation.run import is_random, play
from stickslip.agents.evaluation.standard import keep_of
from stickslip.agents.evaluation.statistics import mean_interval
from stickslip.agents.idle import Idle
from stickslip.agents.registry import machine_by_name

if TYPE_CHECKING:
    from stickslip.agents.evaluation.standard import StandardEpisodes
    from stickslip.envs import TaskDefinition

EPISODES = {"biped": 32, "ugv": 8}
"""Of a task that draws anything; of another task one."""
PLANNERS = ("optimum",)
"""Baselines that plan an episode with exact knowledge of it: not by hand."""
LEFT_OUT = ("receding-horizon",)
"""It plans at every step, for minutes; what it earns lies below the optimum's."""
DIGITS = 6


def measure(task: TaskDefinition) -> dict[str, Any]:
    """The task's entry of known.json."""
    env, params = task.make()
    machine = machine_by_name(task.machine)
    episodes = EPISODES[task.machine] if is_random(params) else 1

    def earned(name: str, player: Any) -> dict[str, Any]:
        print(f"{task.name}: {name}", flush=True)
        played = played_on(task, player, episodes)
        return entry(name, played.reward, played.fell)

    left_out = LEFT_OUT if "mark" in task.parameters else (*LEFT_OUT, STOPPING)
    names = [name for name in machine.baselines if name not in left_out]
    rows = {name: earned(name, machine.baseline(name, env)) for name in names}
    recipe = recipe_of(task.name)
    tried = [*rows.values(), earned(recipe.name, recipe.make(env, params))]
    best = max(tried, key=lambda one: one["return"])
    how = recipe.how if best is tried[-1] else f"the baseline {best['policy']}"
    return {
        "digest": task.digest,
        "episodes": episodes,
        "trivial": earned("idle", Idle(machine.outputs)),
        "baselines": [row for name, row in rows.items() if name not in PLANNERS],
        "planners": [row for name, row in rows.items() if name in PLANNERS],
        "best": best,
        "how": how,
    }


def played_on(task: TaskDefinition, player: Any, episodes: int) -> StandardEpisodes:
    """What is kept of a player's episodes 0, 1, ... on a task."""
    env, params = task.make()
    return play(without_resets(env), player.validate(), params, range(episodes), keep_of)


def entry(name: str, rewards: Any, fell: Any) -> dict[str, Any]:
    """A policy's row: mean return with its 95 % interval."""
    mean = mean_interval(rewards)
    ends = {
        end: rounded(value) if np.isfinite(value) else None
        for end, value in (("low", mean.low), ("high", mean.high))
    }
    return {"policy": name, "return": rounded(mean.value), **ends, "failures": float(np.mean(fell))}


def rounded(value: float) -> float:
    """To so many digits: returns are single precision."""
    return float(f"{float(value):.{DIGITS}g}")
