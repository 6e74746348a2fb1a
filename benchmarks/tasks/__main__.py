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
from typing import TYPE_CHECKING, Any

from benchmarks.report import markdown, options, put_between
from benchmarks.tasks.measure import assumed_of, bound_of, measure
from stickslip.agents.evaluation.table import mean_interval
from stickslip.agents.policy.record import record_of
from stickslip.agents.policy.shipped import policy_name, shipped_path
from stickslip.envs import TASKS, TaskDefinition, known_of, task_by_name
from stickslip.envs.tasks.known import FILE, read_known
from stickslip.records.files import write_whole
from stickslip.records.table import json_text

if TYPE_CHECKING:
    from stickslip.envs.tasks.known import Bound, Earned, Known, Learned

MARKS = ("<!-- tasks -->", "<!-- end of tasks -->")
DOCS = Path(__file__).parents[2] / "docs"


def put(name: str, entry: dict[str, Any], path: Path = FILE) -> None:
    """Write a task's entry beside the others; those of tasks that are no more go."""
    read_known.cache_clear()
    tasks = read_known(path) if path.exists() else {}
    tasks = {**tasks, name: entry}
    kept = {one: tasks[one] for one in TASKS if one in tasks}
    write_whole(path, json_text({"format": "stickslip known scores", "version": 1, "tasks": kept}))
    read_known.cache_clear()


def bounds(task: TaskDefinition) -> dict[str, Any]:
    """The entries of what is proved."""
    return {"bound": bound_of(task), "assumed": assumed_of(task)}


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
        put_between(asked.docs, long_table(), MARKS)
        return
    known = read_known(asked.out) if asked.out.exists() else {}
    for name in asked.only or [name for name in TASKS if asked.bounds or name not in known]:
        task = task_by_name(name)
        if asked.bounds:
            put(task.name, {**known[task.name], **bounds(task)}, asked.out)
        else:
            before = known.get(task.name, {})
            learned = {name: one for name, one in before.items() if name == "learned"}
            put(task.name, {**measure(task, before), **bounds(task), **learned}, asked.out)


if __name__ == "__main__":
    main(sys.argv[1:])
