"""The ladder of tasks: what is earned on each, and the page that says so.

    python -m benchmarks.tasks [--only NAME ...] [--bounds]
    python -m benchmarks.tasks --docs docs/tasks.md

Without --docs: measures the tasks named (default: those of which nothing is known yet) and puts
what comes out into known.json, which the package carries. --bounds: only what is proved. --docs:
puts the table of what is known into this page, measuring nothing.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from benchmarks.report import markdown, options, put_between
from benchmarks.steady import bound_steady_reward
from stickslip.agents.biped.machine import STOPPING
from stickslip.agents.evaluation.rollout import Idle, first_state, is_random, play, without_resets
from stickslip.agents.evaluation.table import keep_of, mean_interval
from stickslip.agents.machine import machine_by_name
from stickslip.agents.policy.file import record_of
from stickslip.agents.policy.shipped import policy_name, shipped_path, short_name
from stickslip.agents.ugv.controllers import Optimum
from stickslip.dynamics.biped import BipedParams
from stickslip.envs import TASKS, TaskDefinition, known_of, task_by_name
from stickslip.envs.tasks.known import FILE, read_known
from stickslip.optim import bound_every_drive
from stickslip.records.files import write_whole
from stickslip.records.table import json_text

if TYPE_CHECKING:
    from stickslip.agents.evaluation.table import StandardEpisodes
    from stickslip.envs import UGVEnv
    from stickslip.envs.tasks.known import Bound, Earned, Known, Learned

EPISODES = {"biped": 32, "ugv": 64}
"""Episodes of a task whose resets draw; of another task one."""
PLANNERS = ("optimum",)
"""Baselines that plan an episode with exact knowledge of it: not by hand."""
LEFT_OUT = ("receding-horizon",)
"""It plans at every step, for minutes; what it earns lies below the optimum's."""
DIGITS = 6
STARTS = {"phase", "crank_rate"}
CELLS = 200
ROUNDING = 5e-4
"""Relative excess of a return in single precision over a bound in double that is rounding."""
DOCS = Path(__file__).parents[1] / "docs"


def measure(task: TaskDefinition, before: dict[str, Any]) -> dict[str, Any]:
    """The task's entry of known.json. before: the entry there; a better best known stays."""
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
    if before.get("digest") == task.digest and before["best"]["return"] > best["return"]:
        best, how = before["best"], before["how"]
    planners = [row for name, row in rows.items() if name in PLANNERS]
    found = {
        "digest": task.digest,
        "episodes": episodes,
        "trivial": earned("idle", Idle(len(env.action_names))),
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
    short = short_name(record.path)
    again = before["policy"] == short  # it was the best known before it was retrained
    others = [*found["baselines"], *found["planners"], *([] if again else [before])]
    if record.earned_return <= max(one["return"] for one in others):
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
        f"the package's {short}, a network trained with PPO by `{record.command}`, "
        "from the observation alone"
    )
    return {**found, "planners": planners, "best": best, "how": how}


def played_on(task: TaskDefinition, player: Any, episodes: int) -> StandardEpisodes:
    """Play episodes 0, 1, ... of a task."""
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
    """The value to DIGITS digits: returns are single precision."""
    return float(f"{float(value):.{DIGITS}g}")


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


def put(name: str, entry: dict[str, Any], path: Path = FILE) -> None:
    """Write a task's entry beside the others; those of tasks that are no more go."""
    read_known.cache_clear()
    tasks = read_known(path) if path.exists() else {}
    tasks = {**tasks, name: entry}
    kept = {one: tasks[one] for one in TASKS if one in tasks}
    write_whole(path, json_text({"format": "stickslip known scores", "version": 1, "tasks": kept}))
    read_known.cache_clear()


def long_table() -> str:
    """Scores and returns of each task, and a paragraph for each."""
    rows: list[dict[str, Any]] = []
    for task in TASKS.values():
        known = known_of(task)
        if known is None:
            continue
        learned = known.learned
        rows.append(
            {
                "task": f"`{task.name}`",
                "idle (0)": f"{known.trivial.value:.4g}",
                "best by hand": _cell(known, known.by_hand),
                "PPO": "" if learned is None else _learned(known, learned),
                "shipped": _shipped(task.name),
                "best known (1)": known.best.shown,
                "if steady, no slip": _at_most(known.assumed),
                "proved: at most": _at_most(known.bound),
            }
        )
    return f"{markdown(rows)}\n\n{_in_words()}"


def _in_words() -> str:
    """Title and description of each task, and its picture (`python -m documentation.tasks`)."""
    found = []
    for task in TASKS.values():
        if known_of(task) is not None:
            asked = f"**{task.name}**: {task.title} [{task.unit}]. {task.about}"
            picture = f"tasks/{task.name}.png"
            drawn = (DOCS / picture).exists()
            found.append(f"{asked}\n\n![{task.name}]({picture})" if drawn else asked)
    return "\n\n".join(found)


def _cell(known: Known, earned: Earned) -> str:
    return f"{known.score_of(earned).shown(2)}: {earned.shown}, {earned.policy}"


def _shipped(task: str) -> str:
    """The score of the package's policy."""
    if shipped_path(policy_name(task)) is None:
        return ""
    score = record_of(policy_name(task)).score
    return "" if score is None else score.shown(2)


def _learned(known: Known, learned: Learned) -> str:
    return mean_interval([known.scale.score(one) for one in learned.returns]).shown(2)


def _at_most(bound: Bound | None) -> str:
    return "" if bound is None else f"{bound.value:.4g}"


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
