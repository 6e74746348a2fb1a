"""PPO on every task of the ladder: return against steps and time.

    python -m benchmarks.training [--trainers jax sb3] [--only NAME ...] [--again] [--out FILE]
    python -m benchmarks.training --redraw

Trains five seeds a task with the JAX trainer, as a population, and with SB3, one after the other,
with the budgets of budgets.py; the policies play the task's own episodes at 16 points of the way.
What the JSON has already, of the same definition and settings, is left as it is (--again measures
it anew): so a run that was cut off goes on with the task it was at. --redraw writes table and
picture of docs/training.md, the entries "learned" of the ladder's known.json and the table of
docs/tasks.md.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

from benchmarks.report import options, provenance, put_between, read_json, write_json
from benchmarks.tasks.__main__ import MARKS as TASK_MARKS
from benchmarks.tasks.__main__ import put
from benchmarks.tasks.tables import long_table
from benchmarks.training import tables
from benchmarks.training.budgets import BUDGETS, configuration
from benchmarks.training.measure import measure
from stickslip.envs import TASKS, TaskDefinition, task_by_name
from stickslip.envs.tasks.known import FILE, read_known

PAGE, PICTURE, TASK_PAGE = (
    Path("docs/training.md"),
    Path("docs/training.png"),
    Path("docs/tasks.md"),
)
MARKS = ("<!-- training -->", "<!-- end of training -->")
TRAINERS = ("jax", "sb3")


def main(arguments: list[str]) -> None:
    """Measure and write, or write what was measured into pages."""
    parser = options("training", __doc__)
    parser.add_argument("--trainers", nargs="+", choices=TRAINERS, default=list(TRAINERS))
    parser.add_argument("--only", nargs="+", metavar="NAME")
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--redraw", action="store_true")
    given = parser.parse_args(arguments)
    if given.redraw:
        redraw(read_json(given.out))
        return
    for trainer in given.trainers:
        for name in given.only or TASKS:
            task = task_by_name(name)
            content = read_json(given.out)
            if not given.again and _is_there(content, trainer, task):
                print(f"{task.name}, {trainer}: is there", flush=True)
                continue
            begun = time.perf_counter()
            print(f"{task.name}, {trainer}", flush=True)
            found = measure(trainer, task, lambda line: print("  " + line, flush=True))
            entry = {**found, "seconds_in_all": round(time.perf_counter() - begun, 1)}
            content = {**content, **provenance()}
            content.setdefault("tasks", {}).setdefault(task.name, {})[trainer] = entry
            write_json(content, given.out)


def _is_there(content: dict[str, Any], trainer: str, task: TaskDefinition) -> bool:
    """Whether a task was measured with this definition and these settings."""
    found = content.get("tasks", {}).get(task.name, {}).get(trainer)
    budget = BUDGETS[trainer, task.machine]
    wanted = {
        "digest": task.digest,
        "config": configuration(trainer, task, 0).digest,
        "seeds": list(budget.seeds),
    }
    return found is not None and all(found[name] == one for name, one in wanted.items())


def redraw(content: dict[str, Any]) -> None:
    """Write pages, picture and what is known of learning."""
    from benchmarks.training.picture import draw

    put_between(PAGE, tables.body(content), MARKS)
    draw(content, PICTURE)
    for name, entries in content["tasks"].items():
        known = read_known(FILE)
        if name in known and name in TASKS and "jax" in entries:
            put(name, {**known[name], "learned": tables.learned(entries["jax"], name)})
    put_between(TASK_PAGE, long_table(), TASK_MARKS)


if __name__ == "__main__":
    main(sys.argv[1:])
