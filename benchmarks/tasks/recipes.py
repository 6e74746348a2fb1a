"""Where the best known score of each task comes from: a way to make a policy, in words, too."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

from stickslip.agents.biped.controllers import controller_by_name
from stickslip.agents.biped.state_map import BipedStates
from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.optimum import Improved, solve
from stickslip.agents.ugv.plans import Optimum
from stickslip.optim.dynamic_programming import Ahead

FINENESS, ACTIONS, DEPTH, BEAM = 1.0, 41, 4, 4
SWITCHES = 3
"""Located in each step."""


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
"""Tasks whose recipe's policy owes more than 1 % to the setting (benchmarks/tasks/finer.py): it
falls when it is computed finely, and is not what 1 stands for."""


def recipe_of(name: str) -> Recipe:
    """Of a task."""
    return RECIPES.get(name, polished(31))
