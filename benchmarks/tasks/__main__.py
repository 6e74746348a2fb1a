"""The ladder of tasks: what is earned on each, and the pages that say so.

    python -m benchmarks.tasks [--only NAME ...] [--learn SEEDS STEPS] [--docs FILE]
        [--pictures FOLDER] [--check] [--bounds]

Without --docs and --pictures: measures the tasks named (default: those of which nothing
is known yet), one after the other, and puts what comes out into known.json, which the package
carries. --learn: PPO instead, beside what is there. --docs: puts the table of what is known
into this page, measuring nothing. --pictures: draws those of docs/tasks.md, of the tasks
named or all.
--check: plays doing nothing and every baseline again and says what differs, writing nothing.
--bounds: what is proved anew, and nothing else.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from benchmarks.report import options, put_between
from benchmarks.tasks.bounds import assumed_of, bound_of
from benchmarks.tasks.check import Again, measured_again
from benchmarks.tasks.measure import measure
from benchmarks.tasks.recipes import ALIKE
from benchmarks.tasks.tables import long_table
from stickslip.envs import TASKS, TaskDefinition, known_of, task_by_name
from stickslip.envs.tasks.known import FILE, FORMAT, VERSION, read_known
from stickslip.records.files import write_whole
from stickslip.records.table import json_text

MARKS = ("<!-- tasks -->", "<!-- end of tasks -->")


def put(name: str, entry: dict[str, Any], path: Path = FILE) -> None:
    """Write a task's entry beside the others; those of tasks that are no more go."""
    read_known.cache_clear()
    tasks = read_known(path) if path.exists() else {}
    tasks = {**tasks, name: entry}
    kept = {one: tasks[one] for one in TASKS if one in tasks}
    write_whole(path, json_text({"format": FORMAT, "version": VERSION, "tasks": kept}))
    read_known.cache_clear()


def bounds(task: TaskDefinition) -> dict[str, Any]:
    """The entries of what is proved."""
    return {"bound": bound_of(task), "assumed": assumed_of(task)}


def check(names: list[str]) -> None:
    """Say of every number of these tasks whether it still comes out."""
    found: list[Again] = []
    for task in map(task_by_name, names):
        known = known_of(task)
        for one in () if known is None else measured_again(task, known):
            print(one.line(), flush=True)
            found.append(one)
    off = max(found, key=lambda one: one.score_off)
    print(f"{sum(one.same for one in found)} of {len(found)} as written to the last digit; the "
          f"furthest: {off.line()}")  # fmt: skip


def main(arguments: list[str]) -> None:
    """Measure and write, or put what is known into pages."""
    parser = options("tasks", __doc__, FILE)
    parser.add_argument("--only", nargs="+", metavar="NAME")
    parser.add_argument("--learn", nargs=2, type=int, metavar=("SEEDS", "STEPS"))
    parser.add_argument("--docs", type=Path)
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("--bounds", action="store_true")
    parser.add_argument("--check", action="store_true")
    asked = parser.parse_args(arguments)
    if asked.docs is not None:
        put_between(asked.docs, long_table(), MARKS)
    if asked.pictures is not None:
        from benchmarks.tasks.picture import draw_task

        asked.pictures.mkdir(parents=True, exist_ok=True)
        for task in map(task_by_name, asked.only or TASKS):
            print(f"{task.name}: picture", flush=True)
            draw_task(task, asked.pictures / f"{task.name}.png")
    if asked.check:
        check(asked.only or list(TASKS))
    if asked.check or any(one is not None for one in (asked.docs, asked.pictures)):
        return
    known = read_known(asked.out) if asked.out.exists() else {}
    names = asked.only or [
        name for name in TASKS if name not in known or asked.learn or asked.bounds
    ]
    for name in names:
        task = task_by_name(name)
        if asked.learn is not None:
            from benchmarks.tasks.learn import learn

            put(task.name, {**known[task.name], "learned": learn(task, *asked.learn)}, asked.out)
        elif asked.bounds:
            put(task.name, {**known[task.name], **bounds(task)}, asked.out)
        elif task.name in ALIKE:
            same = read_known(asked.out)[ALIKE[task.name]]
            put(task.name, {**same, "digest": task.digest}, asked.out)
        else:
            before = {k: v for k, v in known.get(task.name, {}).items() if k == "learned"}
            put(task.name, {**measure(task), **bounds(task), **before}, asked.out)


if __name__ == "__main__":
    main(sys.argv[1:])
