"""PPO on every task of the ladder: return against steps and time.

    python -m benchmarks.training [--only NAME ...] [--out FILE]
    python -m benchmarks.training --redraw

Trains five seeds a task with the JAX trainer; the policies play the task's own
episodes at 16 points of the way. What the JSON has already, of the same definition and settings,
is left as it is. --redraw writes the table of docs/training.md, the entries "learned" of the
ladder's known.json and the table of docs/tasks.md.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks import report
from benchmarks.tasks import EPISODES, long_table, put, rounded
from stickslip.agents.evaluation.rollout import is_random, play, without_resets
from stickslip.agents.evaluation.table import keep_of, mean_interval
from stickslip.agents.machine import machine_by_name
from stickslip.agents.training.ppo import PPOTrainer, settings_of
from stickslip.envs import TASKS, known_of, task_by_name
from stickslip.envs.tasks.known import FILE, SOLVED, read_known

if TYPE_CHECKING:
    from stickslip.agents.training.configuration import Configuration
    from stickslip.envs import TaskDefinition

PAGE, TASK_PAGE = Path("docs/training.md"), Path("docs/tasks.md")
STRETCHES, SEEDS = 16, (0, 1, 2, 3, 4)
"""Evaluations of a training; seeds of each task."""
TIMESTEPS = {"biped": 8_000_000, "ugv": 524_288}
"""Steps of each seed."""


def configuration(task: TaskDefinition) -> Configuration:
    """The defaults of `stickslip train` for the task, with TIMESTEPS.

    The biped's training episodes are short where every place is as good as another, begin at any
    phase and up to a higher crank rate, and penalise slips and falls less: otherwise standing still
    is learnt. Its noise ends at 0.03, since its steps are a quarter of the default. The UGV's
    rewards are scaled.
    """
    kind: Any = machine_by_name(task.machine).configuration
    given: dict[str, Any] = {"task": task.name, "timesteps": TIMESTEPS[task.machine]}
    if task.machine == "ugv":
        return kind.of(**given, failure=kind.USUALLY["failure"])
    usual: Any = kind.USUALLY
    known: Any = task.parameters
    drawn = known.get("randomisation", {}).get("crank_rate", (0.0,))
    given |= {name: min(known[name], usual[name]) for name in ("slip_weight", "fall_penalty")}
    if "uniform" in known["scene"] and "mark" not in known:
        given["episode_time"] = usual["episode_time"]
    return kind.of(**given, final_noise=0.03, start_rate=max(drawn[-1], usual["start_rate"]))


def measure(task: TaskDefinition) -> dict[str, Any]:
    """A task's entry: all seeds in turn on one core, each with its share of the time, without
    compiling and evaluations."""
    config = configuration(task)
    env, training, params, _ = machine_by_name(task.machine).training_task(config)
    test, seen = without_resets(env), range(EPISODES[task.machine] if is_random(env, params) else 1)
    samples = settings_of(config)[0].samples
    PPOTrainer(config, env, training).advance(samples)  # compiles
    trainers = [PPOTrainer(replace(config, seed=seed), env, training) for seed in SEEDS]
    spent, rows, updates = 0.0, [], -(-config.timesteps // samples)
    for part in range(1, STRETCHES + 1):
        begun = time.process_time()
        for trainer in trainers:
            trainer.advance(-(-updates * part // STRETCHES) * samples)
        spent += time.process_time() - begun
        played = [play(test, one.policy(), params, seen, keep_of) for one in trainers]
        returns = [rounded(float(one.reward.mean())) for one in played]
        rows.append((trainers[0].timesteps, spent, returns))
        print(f"  {rows[-1][0]:>10,} steps, {spent:.1f} s: {rows[-1][-1]}", flush=True)

    passed, processor, returns = zip(*rows, strict=True)
    return {
        "digest": task.digest,
        "seeds": list(SEEDS),
        "config": config.digest,
        "steps": list(passed),
        "processor_seconds": [round(one / len(SEEDS), 3) for one in processor],
        "returns": [list(one) for one in zip(*returns, strict=True)],
    }


def scores(entry: dict[str, Any], name: str) -> np.ndarray:
    """Scores [seeds, points] of an entry."""
    known: Any = known_of(TASKS[name])
    return known.scale.score(np.asarray(entry["returns"], float))


def reached(entry: dict[str, Any], name: str) -> list[int]:
    """First point with a score of SOLVED, for each seed that has one."""
    good = scores(entry, name) >= SOLVED
    return [int(np.argmax(row)) for row in good if row.any()]


def body(content: dict[str, Any]) -> str:
    """Steps, time and scores on each task."""
    tasks = content.get("tasks", {})
    rows = [{"task": f"`{name}`"} | row(tasks[name], name) for name in TASKS if name in tasks]
    places = dict.fromkeys(report.where(content | one) for one in tasks.values())
    return f"{report.markdown(rows)}\n\nMeasured on {'; '.join(places)}."


def row(entry: dict[str, Any], name: str) -> dict[str, str]:
    """A task's line."""
    found, first = scores(entry, name), reached(entry, name)
    end = mean_interval(found[:, -1])
    point = None if len(first) <= len(found) / 2 else int(np.median(first))
    steps, seconds = entry["steps"], entry["processor_seconds"]
    return {
        "seeds": f"{len(found)}",
        "steps": f"{steps[-1] / 1e6:.2g} M",
        "processor [s]": f"{seconds[-1]:.0f}",
        "score at the end": f"{end.value:.2f} ± {end.high - end.value:.2f}",
        f"reach {SOLVED}": f"{len(first)} of {len(found)}",
        "after, steps": "" if point is None else f"{steps[point] / 1e6:.2g} M",
        "after, processor [s]": "" if point is None else f"{seconds[point]:.1f}",
    }


def learned(entry: dict[str, Any]) -> dict[str, Any]:
    """The entry "learned" of known.json: what the last policies earn."""
    how = (
        "PPO in JAX, the defaults and training episodes of `stickslip train`, "
        f"{entry['steps'][-1]:,} steps (docs/training.md)"
    )
    return {"how": how, "returns": [rounded(one[-1]) for one in entry["returns"]]}


def is_there(content: dict[str, Any], task: TaskDefinition) -> bool:
    """True if a task was measured with this definition and these settings."""
    found = content.get("tasks", {}).get(task.name)
    wanted = {"digest": task.digest, "config": configuration(task).digest, "seeds": list(SEEDS)}
    return found is not None and all(found[name] == one for name, one in wanted.items())


def redraw(content: dict[str, Any]) -> None:
    """Write pages and what is known of learning."""
    report.put_between(PAGE, body(content), "training")
    for name, entry in content["tasks"].items():
        known = read_known(FILE)
        if name in known and name in TASKS:
            put(name, {**known[name], "learned": learned(entry)})
    report.put_between(TASK_PAGE, long_table(), "tasks")


def main(arguments: list[str]) -> None:
    """Measure and write, or write what was measured into pages."""
    parser = report.options("training", __doc__)
    parser.add_argument("--only", nargs="+", metavar="NAME")
    parser.add_argument("--redraw", action="store_true")
    given = parser.parse_args(arguments)
    if given.redraw:
        redraw(report.read_json(given.out))
        return
    usual = [name for name, task in TASKS.items() if task.cost_limit is None]
    for task in map(task_by_name, given.only or usual):  # scores here do not ask for costs
        content = report.read_json(given.out)
        if is_there(content, task):
            print(f"{task.name}: is there", flush=True)
            continue
        print(task.name, flush=True)
        here = report.provenance()
        content = here | {"tasks": {}} | content
        content["tasks"][task.name] = measure(task) | here
        report.write_json(content, given.out)


if __name__ == "__main__":
    main(sys.argv[1:])
