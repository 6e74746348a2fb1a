"""The ladder of tasks: what is earned on each, and the page that says so.

    python -m benchmarks.tasks [--only NAME ...] [--bounds]
    python -m benchmarks.tasks --docs docs/tasks.md

Without --docs: measures the tasks named (default: those of which nothing is known yet) and puts
what comes out into known.json, which the package carries. --bounds: only what is proved. --docs:
puts the table of what is known into this page, measuring nothing. On a task with a cost limit
baselines under the shield are measured, too, which see the floor, and the best known keeps it.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
from scipy.optimize import minimize_scalar

from benchmarks.report import markdown, options, put_between
from stickslip.agents.evaluation.evaluate import env_with
from stickslip.agents.evaluation.rollout import Idle, first_state, is_random, play, without_resets
from stickslip.agents.evaluation.table import keep_of, mean_interval
from stickslip.agents.machine import machine_by_name
from stickslip.agents.policy.file import record_of
from stickslip.agents.policy.shipped import policy_name, shipped_names, shipped_path
from stickslip.agents.ugv.controllers import Optimum
from stickslip.dynamics.biped import BipedParams
from stickslip.envs import TASKS, TaskDefinition, UGVEnv, known_of, task_by_name
from stickslip.envs.tasks.known import FILE, Earned, Known, read_known
from stickslip.optim import bound_every_drive
from stickslip.optim.gait.problem import GaitProblem
from stickslip.optim.gait.profile import robot_of
from stickslip.optim.problem import require_scalar, solve
from stickslip.records.files import write_whole
from stickslip.records.table import json_text


class SteadyBound(NamedTuple):
    """Bound of the reward in every gait [1/s], and mean rate of the nearest gait [rad/s]."""

    value: float
    mean_rate: float


def bound_steady_reward(
    params: BipedParams,
    mean_rate: float,
    *,
    mu: float,
    torque_limit: float,
    tracking_weight: float = 1.0,
    energy_weight: float = 0.5,
    copper_loss: float = 0.5,
    cells: int = 200,
) -> SteadyBound:
    """Upper bound on the reward of a steady walk without slip, for each second.

    A step of a walk that repeats itself takes the time t and the energy E over the length L. The
    reward is tracking (1 - |v - v*| / v*), at least -1, less price E / t. No v earns more tracking
    than s v / v* + 1 - s, whatever the share s from 0 to 1, and v averages to L / t. With
    t* = L / v* the reward of a second is therefore at most

        tracking (s t* / t + 1 - s) - price E / t  <=  c = tracking + beta - V(beta) / t*

    for any beta >= 0 with V(beta) <= price t* E + beta t in every gait, taking
    s = V / (tracking t*). V comes from the convex program's multipliers (certificate.py).

    Rewards as of `BipedEnv`: energy_weight times positive work and copper loss [W/(N m)^2], over
    weight and commanded speed. mu: static friction. Assumed: the walk repeats itself step by step,
    the foot neither slips nor tips, and the crank (so the centre of mass) does not turn back.
    Torque may change at any instant, and speed that varies within a step costs nothing here, so the
    bound is above what a motor that holds its torque can earn. ValueError for numbers out of range,
    and where no gait is found.
    """
    for name, given in (("mean_rate", mean_rate), ("tracking_weight", tracking_weight)):
        require_scalar(name, given, low=0.0, strict=True, accepted="a finite number > 0")
    require_scalar("energy_weight", energy_weight, low=0.0, accepted="a finite number >= 0")
    limits = {"mu": mu, "torque_limit": torque_limit, "copper_loss": copper_loss, "zmp": True}
    usual = np.pi / mean_rate
    robot = robot_of(params, 1, True)
    price = energy_weight * usual / (robot.weight * robot.step_length)

    def least(goal: dict[str, float]) -> tuple[float, float]:
        """Lower bound of a gait's cost, and the mean rate of the best."""
        answer = solve(GaitProblem.periodic(params, goal, steps=cells, **limits))
        if answer.every_bound is None or answer.gait is None:
            raise ValueError(f"no gait: {answer.message}; accepted: limits that leave one")
        return answer.every_bound, answer.gait.mean_rate

    fastest, rate = least({"time": 1.0})
    most = tracking_weight * usual / fastest  # beta where the share is 1 without any price
    if price == 0:
        return SteadyBound(float(min(most, tracking_weight)), rate)
    found: list[SteadyBound] = []

    def earned(beta: float) -> float:
        value, rate = least({"energy": price, "time": beta})
        share = value / (tracking_weight * usual)
        if share > 1:  # nothing is proved there: less beta is better
            return tracking_weight * share + beta
        found.append(SteadyBound(float(tracking_weight + beta - value / usual), rate))
        return found[-1].value

    ends = 1e-6 * tracking_weight, most
    options = {"xatol": 1e-4 * most, "maxiter": 40}  # of beta; programs solved
    searched: Any = minimize_scalar(earned, bounds=ends, method="bounded", options=options)
    if not found:
        raise ValueError(f"nothing is proved ({searched.message}); accepted: other weights")
    best = min(found)
    return best._replace(value=min(best.value, tracking_weight))


EPISODES = {"biped": 32, "ugv": 64}
"""Episodes of a task whose resets draw; of another task one."""
VALUE_ITERATION = "dynamic programming"
"""Of `python -m benchmarks.optimum`, where it was tried."""
PLANNERS = ("optimum",)
"""Baselines that plan an episode with exact knowledge of it: not by hand."""
SHIELDED, SHIELD = ("computed-torque", "optimal-gait"), 0.02
"""Baselines that are measured under the shield, too, and its margin."""
UNDER = f" (shield {SHIELD:g})"
ROUNDING = 5e-4
"""Relative excess of a return in single precision over a bound in double that is rounding."""
DOCS = Path(__file__).parents[1] / "docs"


def measure(task: TaskDefinition, before: dict[str, Any]) -> dict[str, Any]:
    """The task's entry of known.json. before: the entry there; a better best known stays."""
    env, params = task.make()
    machine = machine_by_name(task.machine)
    episodes = EPISODES[task.machine] if is_random(env, params) else 1

    def earned(name: str, player: Any, shield: float | None = None) -> dict[str, Any]:
        print(f"{task.name}: {name}", flush=True)
        return entry(task, name, played_on(task, player, episodes, shield))

    left_out = () if "mark" in task.parameters else ("stop-at-mark",)  # it is optimal-gait there
    names = [name for name in machine.baselines if name not in left_out]
    rows = {name: earned(name, machine.baseline(name, env)) for name in names}
    if task.cost_limit is not None:
        for name in SHIELDED:
            rows[f"{name}{UNDER}"] = earned(f"{name}{UNDER}", machine.baseline(name, env), SHIELD)
    best = max(filter(partial(keeps, task), rows.values()), key=lambda one: one["return"])
    how = f"the baseline {best['policy']}"
    if before.get("digest") == task.digest and before["best"]["return"] > best["return"]:
        best, how = before["best"], before["how"]
    planners = [row for name, row in rows.items() if name in PLANNERS or name.endswith(UNDER)]
    baselines = [row for row in rows.values() if row not in planners]
    if before.get("digest") == task.digest:  # those that other commands measured stay
        planners += [row for row in before["planners"] if row["policy"] not in rows]
    found = {
        "digest": task.digest,
        "episodes": episodes,
        "trivial": earned("idle", Idle(len(env.action_names))),
        "baselines": baselines,
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
    latest = (one for one in shipped_names() if shipped_path(one) == record.path)
    short = next(latest, record.path.stem)
    again = before["policy"] == short  # it was the best known before it was retrained
    others = [*found["baselines"], *found["planners"]]
    others += [] if again or before in others else [before]
    kept = filter(partial(keeps, task), others)
    if record.earned_return <= max(one["return"] for one in kept) or not keeps(task, record.earned):
        if again:
            raise ValueError(
                f"{short} is the best known of {task.name} no more; accepted: `python "
                f"-m benchmarks.tasks --only {task.name}`, which measures who is"
            )
        return found
    planners = [one for one in others if one not in found["baselines"]]
    best = {"policy": short, **record.earned}
    best.pop("episodes")
    how = (
        f"the package's {short}, a network trained by `{record.command}`, "
        "from the observation alone"
    )
    return {**found, "planners": planners, "best": best, "how": how}


def played_on(task: TaskDefinition, player: Any, episodes: int, shield: float | None = None) -> Any:
    """Play episodes 0, 1, ... of a task; where it has a cost limit, with their costs."""
    env, params = task.make()
    env = without_resets(env_with(env, shield))
    own = machine_by_name(task.machine).measures(env).keep
    keep = keep_of if task.cost_limit is None else own
    return play(env, player.validate(), params, range(episodes), keep)


def keeps(task: TaskDefinition, row: dict[str, Any]) -> bool:
    """True for a policy's row within the task's cost limit, if it has one."""
    return task.cost_limit is None or row["cost"] <= task.cost_limit


def entry(task: TaskDefinition, name: str, played: Any) -> dict[str, Any]:
    """A policy's row: all returns, their mean with its 95 % interval, the mean of limited costs."""
    mean = mean_interval(played.reward)
    low, high = (rounded(end) if np.isfinite(end) else None for end in (mean.low, mean.high))
    row: dict[str, Any] = {"policy": name, "return": rounded(mean.value), "low": low, "high": high}
    row["failures"] = float(np.mean(played.fell))
    if task.cost_limit is not None:
        row["cost"] = rounded(np.mean(played.cost))
    return row | {"returns": [rounded(one) for one in played.reward]}


def rounded(value: float) -> float:
    """The value to six digits: returns are single precision."""
    return float(f"{float(value):.6g}")


def bound_of(task: TaskDefinition) -> dict[str, Any] | None:
    """Proved bound for every policy, or None."""
    env, params = task.make()
    if task.machine == "biped":
        return {
            "value": rounded(float(params.tracking_weight) * float(params.time_limit)),
            "reason": "no step's reward is above tracking_weight times the period; nothing is "
            "assumed of the walk",
        }
    env, least = cast("UGVEnv", without_resets(env)), []
    count = EPISODES["ugv"] if is_random(env, params) else 1
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
    """Bound for steady walks without slip; None where more than the start is drawn, where the floor
    changes on the way, and where the walk is to stop."""
    numbers: Any = task.parameters
    drawn = set(numbers.get("randomisation", {})) - {"phase", "crank_rate"}
    if task.machine != "biped" or drawn or "mark" in numbers or "uniform" not in numbers["scene"]:
        return None
    names = ("mean_rate", "torque_limit", "tracking_weight", "energy_weight", "copper_loss")
    given = {name: numbers[name] for name in names}
    mu = numbers["scene"]["uniform"]["mu_static"]
    found = bound_steady_reward(BipedParams.from_bars(), mu=mu, **given)
    return {
        "value": rounded(found.value * numbers["time_limit"]),
        "reason": "the dual of the convex program of gaits, if the walk is steady from the first "
        "step on and the foot neither slips nor tips",
    }


def with_planner(before: dict[str, Any], row: dict[str, Any], how: str) -> dict[str, Any]:
    """A task's entry with a row among its planners, or as the best known where it earned most.

    how: where the row came from.
    """
    best, own = before["best"], row["policy"]
    if best["policy"] == own and best["return"] >= row["return"]:
        return before
    planners = [one for one in before["planners"] if one["policy"] != own]
    if best["return"] >= row["return"]:
        return {**before, "planners": [*planners, row]}
    if best["policy"] != own and best not in before["baselines"]:
        planners.append(best)
    return {**before, "planners": planners, "best": row, "how": how}


def put(name: str, entry: dict[str, Any], path: Path = FILE) -> None:
    """Write a task's entry beside the others; those of tasks that are no more go."""
    read_known.cache_clear()
    tasks = read_known(path) if path.exists() else {}
    tasks = {**tasks, name: entry}
    kept = {one: tasks[one] for one in TASKS if one in tasks}
    write_whole(path, json_text({"format": "stickslip known scores", "version": 1, "tasks": kept}))
    read_known.cache_clear()


def by_value_iteration(known: Known) -> list[Earned]:
    """What value iteration earned, as the best known or as a planner; [] where it was not tried."""
    return [one for one in (known.best, *known.planners) if one.policy == VALUE_ITERATION]


def long_table() -> str:
    """Scores and returns of each task, and a paragraph for each."""
    rows: list[dict[str, Any]] = []
    words: list[str] = []
    for task in TASKS.values():
        known = known_of(task)
        if known is None:
            continue
        hand, learned, name = known.by_hand, known.learned, policy_name(task.name)
        scores = [known.scale.score(one) for one in learned.returns] if learned else []
        planned = by_value_iteration(known)
        shipped = None if shipped_path(name) is None else record_of(name).score
        limits = ["" if one is None else f"{one.value:.4g}" for one in (known.assumed, known.bound)]
        rows.append(
            {
                "task": f"`{task.name}`",
                "tier": task.tier,
                "idle (0)": f"{known.trivial.value:.4g}",
                "best by hand": f"{known.score_of(hand).shown(2)}: {hand.shown}, {hand.policy}",
                "dynamic programming": known.score_of(planned[0]).shown(2) if planned else "",
                "PPO": "" if learned is None else mean_interval(scores).shown(2),
                "shipped": "" if shipped is None else shipped.shown(2),
                "best known (1)": known.best.shown,
                "if steady, no slip": limits[0],
                "proved: at most": limits[1],
            }
        )
        words.append(f"**{task.name}**: {task.title} [{task.unit}]. {task.about}")
        picture = f"tasks/{task.name}.png"  # of `python -m documentation.tasks`
        if (DOCS / picture).exists():
            words.append(f"![{task.name}]({picture})")
    return "\n\n".join([markdown(rows), *words])


def main(arguments: list[str]) -> None:
    """Measure and write, or put what is known into the page."""
    parser = options("tasks", __doc__, FILE)
    parser.add_argument("--only", nargs="+", metavar="NAME")
    parser.add_argument("--bounds", action="store_true")
    parser.add_argument("--docs", type=Path)
    asked = parser.parse_args(arguments)
    if asked.docs is not None:
        put_between(asked.docs, long_table(), "tasks")
        return
    known = read_known(asked.out) if asked.out.exists() else {}
    for name in asked.only or [name for name in TASKS if asked.bounds or name not in known]:
        task = task_by_name(name)
        before = known.get(task.name, {})
        earned = before if asked.bounds else measure(task, before)
        learned = {name: one for name, one in before.items() if name == "learned"}
        proved = {"bound": bound_of(task), "assumed": assumed_of(task)}
        put(task.name, {**earned, **proved, **learned}, asked.out)


if __name__ == "__main__":
    main(sys.argv[1:])
