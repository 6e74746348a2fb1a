"""Upper bounds of the return on a task: for every policy, and for walks that meet assumptions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import numpy as np

from benchmarks.tasks.measure import EPISODES, rounded
from stickslip.agents.evaluation.rollout import first_state, is_random, without_resets
from stickslip.agents.ugv.controllers import Optimum
from stickslip.dynamics.biped import BipedParams
from stickslip.optim import bound_every_drive
from stickslip.optim.gait.steady import bound_steady_reward

if TYPE_CHECKING:
    from stickslip.envs import TaskDefinition, UGVEnv

STARTS = {"phase", "crank_rate"}
CELLS = 200
ROUNDING = 5e-4
"""By which a return in single precision may lie above a bound in double, in parts of it."""


def bound_of(task: TaskDefinition) -> dict[str, Any] | None:
    """Proved bound for every policy, or None."""
    env, params = task.make()
    if task.machine == "biped":
        most = float(params.tracking_weight) * float(params.time_limit)
        return {
            "value": rounded(most),
            "reason": "no step's reward is above tracking_weight times the period; nothing is "
            "assumed of the walk",
        }
    env, least = cast("UGVEnv", without_resets(env)), []
    count = EPISODES["ugv"] if is_random(params) else 1
    for seed in range(count):
        state = first_state(env, params, seed)
        problem = env.problem(state, params)
        known = Optimum(31, polish=True).solve(env, params, state).x
        found = bound_every_drive(problem, known, tolerance=0.01)
        least.append(found.value - ROUNDING * abs(found.value))
        print(f"{task.name}: episode {seed}: at least {found.value:.6g}, {found.gap:.1%} below "
              "the best known", flush=True)  # fmt: skip
    return {
        "value": rounded(-float(np.mean(least))),
        "reason": "no leg angles at the episodes' waypoints cost less, on a grid or off it "
        "(interval arithmetic over cells of angles, docs/drives.md), with 0.05 % for rounding",
    }


def assumed_of(task: TaskDefinition) -> dict[str, Any] | None:
    """Bound for steady walks without slip; None where the floor or the robot is drawn
    or changes on the way, and where the walk is to stop."""
    numbers: Any = task.parameters
    drawn = set(numbers.get("randomisation", {})) - STARTS
    if task.machine != "biped" or drawn or "mark" in numbers or "uniform" not in numbers["scene"]:
        return None
    found = bound_steady_reward(
        BipedParams.from_bars(),
        numbers["mean_rate"],
        mu=numbers["scene"]["uniform"]["mu_static"],
        torque_limit=numbers["torque_limit"],
        tracking_weight=numbers["tracking_weight"],
        energy_weight=numbers["energy_weight"],
        copper_loss=numbers["copper_loss"],
        cells=CELLS,
    )
    return {
        "value": rounded(found.value * numbers["time_limit"]),
        "reason": "the dual of the convex program of gaits, if the walk is steady from the first "
        "step on and the foot neither slips nor tips",
    }
