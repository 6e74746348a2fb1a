"""Returns of policies on a task over the episodes of seeds 0, 1, ..., and how the best known
policies are made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stickslip.agents.biped.controllers import controller_by_name
from stickslip.agents.biped.machine import STOPPING
from stickslip.agents.biped.state_map import BipedStates
from stickslip.agents.evaluation.evaluate import is_random, play
from stickslip.agents.evaluation.rollout import Idle, without_resets
from stickslip.agents.evaluation.standard import keep_of
from stickslip.agents.evaluation.table import mean_interval
from stickslip.agents.optimum import Ahead, Improved, solve
from stickslip.agents.policy.record import record_of
from stickslip.agents.policy.shipped import policy_name, shipped_path
from stickslip.agents.registry import machine_by_name
from stickslip.agents.ugv.controllers import Optimum

if TYPE_CHECKING:
    from stickslip.agents.evaluation.standard import StandardEpisodes
    from stickslip.envs import TaskDefinition

EPISODES = {"biped": 32, "ugv": 64}
"""Of a task that draws anything; of another task one."""
PLANNERS = ("optimum",)
"""Baselines that plan an episode with exact knowledge of it: not by hand."""
LEFT_OUT = ("receding-horizon",)
"""It plans at every step, for minutes; what it earns lies below the optimum's."""
DIGITS = 6
FINENESS, ACTIONS, DEPTH, BEAM = 1.0, 41, 4, 4
SWITCHES = 3
"""Located in each step."""


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
    best = max(rows.values(), key=lambda one: one["return"])
    how = f"the baseline {best['policy']}"
    if task.name not in OWING:
        recipe = recipe_of(task.name)
        made = earned(recipe.name, recipe.make(env, params))
        if made["return"] >= best["return"]:
            best, how = made, recipe.how
    planners = [row for name, row in rows.items() if name in PLANNERS]
    found = {
        "digest": task.digest,
        "episodes": episodes,
        "trivial": earned("idle", Idle(machine.outputs)),
        "baselines": [row for name, row in rows.items() if name not in PLANNERS],
        "planners": planners,
        "best": best,
        "how": how,
    }
    return beside_package(task, found)


def beside_package(task: TaskDefinition, found: dict[str, Any]) -> dict[str, Any]:
    """The entry of known.json with the package's trained policy of the task as the best known,
    where it earned more; what was the best before is then among the planners."""
    name = policy_name(task.name)
    if shipped_path(name) is None:
        return found
    record, before = record_of(name), found["best"]
    again = before["policy"] == record.short_name  # it was the best known before it was retrained
    others = [*found["baselines"], *found["planners"], *([] if again else [before])]
    if record.earned_return <= max(one["return"] for one in others):
        if again:
            raise ValueError(
                f"{record.short_name} is the best known of {task.name} no more; accepted: `python "
                f"-m benchmarks.tasks --only {task.name}`, which measures who is"
            )
        return found
    planners = [one for one in others if one not in found["baselines"]]
    best = {"policy": record.short_name, **record.earned}
    best.pop("episodes")
    how = (
        f"the package's {record.short_name}, a network trained with PPO by `{record.command}`, "
        "from the observation alone"
    )
    return {**found, "planners": planners, "best": best, "how": how}


def played_on(task: TaskDefinition, player: Any, episodes: int) -> StandardEpisodes:
    """What is kept of a player's episodes 0, 1, ... on a task."""
    env, params = task.make()
    return play(without_resets(env), player.validate(), params, range(episodes), keep_of)


def entry(name: str, rewards: Any, fell: Any) -> dict[str, Any]:
    """A policy's row: every episode's return, and their mean with its 95 % interval."""
    mean = mean_interval(rewards)
    ends = {
        end: rounded(value) if np.isfinite(value) else None
        for end, value in (("low", mean.low), ("high", mean.high))
    }
    row = {"policy": name, "return": rounded(mean.value), **ends, "failures": float(np.mean(fell))}
    return row | {"returns": [rounded(one) for one in rewards]}


def rounded(value: float) -> float:
    """To so many digits: returns are single precision."""
    return float(f"{float(value):.{DIGITS}g}")


class Recipe(NamedTuple):
    """name: of the policy. how: in words. make: of an environment and its parameters."""

    name: str
    how: str
    make: Callable[[Any, Any], Any]


def programmed(rate: float, parts: int = 1) -> Recipe:
    """Dynamic programming on the environment's step, in so many parts of its own, over the usual
    grid for this crank rate."""

    def make(env: Any, params: Any) -> Any:
        count = parts * env.substeps
        planned = replace(env, substeps=count, max_events=SWITCHES * count) if parts > 1 else env
        states = BipedStates.of(planned, params)
        grid = states.grid(params.replace(commanded_rate=rate), FINENESS)
        found = solve(
            planned, params, grid=grid, actions=ACTIONS, ahead=Ahead(DEPTH, BEAM), states=states
        )
        return found.policy

    step = "step" if parts == 1 else f"step in {parts} parts"
    how = (
        f"value iteration on the environment's own {step} ({ACTIONS} torques, usual grid for "
        f"{rate:g} rad/s), its policy {DEPTH} steps ahead with the {BEAM} best ways kept"
    )
    return Recipe("dynamic programming", how, make)


def improved(baseline: str, count: int, horizon: int) -> Recipe:
    """A baseline improved by trying other actions in the true environment."""

    def make(env: Any, params: Any) -> Any:
        del params
        return Improved(controller_by_name(baseline), without_resets(env), count, horizon)

    how = (
        f"{baseline} improved: {count} torques tried at every step, {baseline} followed for "
        f"{horizon} steps after each, in the true environment (it knows what is hidden)"
    )
    return Recipe(f"{baseline}, improved", how, make)


def polished(angles: int) -> Recipe:
    """The optimiser's path off the grid, played back."""

    def make(env: Any, params: Any) -> Any:
        del env, params
        return Optimum(angles, polish=True)

    how = (
        f"dynamic programming over {angles} x {angles} leg angles or more, then sequential convex "
        "programming off the grid; the path played back (it knows the whole ground)"
    )
    return Recipe("optimum off the grid", how, make)


ALIKE = {"BipedIceSeen-v0": "BipedIce-v0"}
"""Tasks that differ from another one in what is observed alone: whoever reads the state earns the
same on both, and is measured on one."""
RECIPES: dict[str, Recipe] = {
    "BipedSteady-v0": programmed(3.0),
    "BipedFast-v0": programmed(6.5),
    "BipedSlippery-v0": programmed(5.0, 2),
    "BipedWeakMotor-v0": programmed(5.0, 2),
    "BipedThrift-v0": programmed(3.0),
    "BipedSprint-v1": programmed(7.0),
    "BipedStop-v0": programmed(5.0),
    "BipedHiddenFriction-v0": improved("optimal-gait", 7, 20),
    "BipedPayload-v0": improved("optimal-gait", 7, 20),
    "BipedIce-v0": improved("optimal-gait", 7, 20),
}
"""By the task's name; the UGV's tasks are all polished."""
OWING = ("BipedSteady-v0", "BipedFast-v0", "BipedStop-v0")
"""Tasks whose recipe's policy owes more than 1 % of its score to the integrator's step: it falls
when computed in sixteenths of it, and is not the best known."""


def recipe_of(name: str) -> Recipe:
    """Of a task."""
    return RECIPES.get(name, polished(31))
