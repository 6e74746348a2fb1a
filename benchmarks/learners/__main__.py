"""Learners on the same environment: steps and seconds to the same score.

    python -m benchmarks.learners [--tasks NAME ...] [--learners NAME ...] [--seeds N ...]
                                  [--limit S] [--again] [--out FILE]
    python -m benchmarks.learners --redraw

Each learner trains on the training episodes of `stickslip train` until its policy, without
exploration, scores 0.9 on the task's own, or has had so many processor seconds; every one in a
process of its own, with nothing compiled before. What the JSON has already is left as it is
(--again measures it anew), so a run that was cut off goes on where it was. What is not installed is
left out and named: Stable-Baselines3 comes with the extra `sb3`, the others with `sbx` and
`brax`. --redraw writes the table of docs/training.md.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.learners import tables
from benchmarks.learners.race import Race
from benchmarks.report import options, provenance, put_between, read_json, write_json
from stickslip.envs import task_by_name

PAGE = Path("docs/training.md")
MARKS = ("<!-- learners -->", "<!-- end of learners -->")
TASKS = ("BipedSteady-v0", "UGVRandomBumps-v0")
LIMIT = 40.0
"""Processor seconds of a learner."""


class Learner(NamedTuple):
    """Where it is, and the package that it needs."""

    function: str
    package: str
    distribution: str


LEARNERS = {
    "ours": Learner("trainers:ours", "optax", "stickslip"),
    "purejaxrl style": Learner("pure:pure", "optax", "optax"),
    "brax PPO": Learner("brax_ppo:brax_ppo", "brax", "brax"),
    "SB3 PPO": Learner("trainers:sb3_ppo", "stable_baselines3", "stable-baselines3"),
    "SB3 SAC": Learner("vectors:sb3_sac", "stable_baselines3", "stable-baselines3"),
    "sbx PPO": Learner("vectors:sbx_ppo", "sbx", "sbx-rl"),
    "sbx SAC": Learner("vectors:sbx_sac", "sbx", "sbx-rl"),
}


def main(arguments: list[str] | None = None) -> None:
    """Measure and write, or write what was measured into the page."""
    parser = options("learners", __doc__)
    parser.add_argument("--tasks", nargs="+", default=list(TASKS), metavar="NAME")
    parser.add_argument("--learners", nargs="+", choices=LEARNERS, default=list(LEARNERS))
    parser.add_argument("--seeds", nargs="+", type=int, default=[0])
    parser.add_argument("--limit", type=float, default=LIMIT, help="processor seconds of each")
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--redraw", action="store_true")
    parser.add_argument("--one", action="store_true", help="the first of each, in this process")
    given = parser.parse_args(arguments)
    tasks = [task_by_name(name).name for name in given.tasks]
    if given.redraw:
        put_between(PAGE, tables.body(read_json(given.out)), MARKS)
    elif given.one:
        learn(tasks[0], given.learners[0], given.seeds[0], given.limit, given.out)
    else:
        cells = [
            (task, name, seed) for seed in given.seeds for task in tasks for name in given.learners
        ]
        measure(cells, given.limit, given.again, given.out)


def measure(cells: list[tuple[str, str, int]], limit: float, again: bool, out: Path) -> None:
    """Each cell in a process of its own, one after the other."""
    begun = time.perf_counter()
    for index, (task, name, seed) in enumerate(cells):
        passed = time.perf_counter() - begun
        print(f"{index + 1}/{len(cells)}, {passed:.0f} s: {task}, {name}, seed {seed}", flush=True)
        if find_spec(LEARNERS[name].package) is None:
            print(f"    {LEARNERS[name].package} is not installed: left out")
            continue
        if not again and _is_there(read_json(out), task, name, seed, limit):
            print("    is there")
            continue
        command = [sys.executable, "-m", "benchmarks.learners", "--one", "--out", str(out)]
        command += ["--tasks", task, "--learners", name, "--seeds", str(seed)]
        kept = {key: value for key, value in os.environ.items() if "COMPILATION_CACHE" not in key}
        ended = subprocess.run([*command, "--limit", str(limit)], env=kept, check=False)
        if ended.returncode:
            print(f"    it ended with {ended.returncode}: nothing is kept of it", flush=True)


def learn(task: str, name: str, seed: int, limit: float, out: Path) -> None:
    """One learner on one task, added to the JSON."""
    race = Race(task_by_name(task), seed, limit)
    module, _, function = LEARNERS[name].function.partition(":")
    getattr(import_module(f"benchmarks.learners.{module}"), function)(race)
    content = read_json(out) | provenance()
    for one in LEARNERS.values():
        content["versions"] |= _version_of(one.distribution)
    entries = content.setdefault("tasks", {}).setdefault(task, {}).setdefault(name, {})
    entries[str(seed)] = race.entry()
    write_json(content, out)


def _is_there(content: dict[str, Any], task: str, name: str, seed: int, limit: float) -> bool:
    found = content.get("tasks", {}).get(task, {}).get(name, {}).get(str(seed))
    if found is None or found["digest"] != task_by_name(task).digest:
        return False
    return found["reached"] is not None or found["limit"] >= limit


def _version_of(distribution: str) -> dict[str, str]:
    try:
        return {distribution: version(distribution)}
    except PackageNotFoundError:
        return {}


if __name__ == "__main__":
    main()
