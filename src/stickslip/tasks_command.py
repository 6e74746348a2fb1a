"""`stickslip tasks`: the named tasks, and the best known on each."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from stickslip.envs.tasks.definition import TASKS, WITHDRAWN, task_by_name
from stickslip.envs.tasks.known import known_of
from stickslip.records.table import Column, Content, Table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stickslip.envs.tasks.definition import TaskDefinition
    from stickslip.envs.tasks.known import Bound, Earned, Known

NOTE = """
Scores: 0 is a trivial policy (every action 0), 1 the most that a policy is known to have earned in
replay: no proof that no more can be. ±: half of a 95 % bootstrap interval of the difference on the
same episodes. "at most": proved. `stickslip tasks NAME` tells more.
"""


def tasks_command(flags: Mapping[str, Any]) -> Content:
    """Print all tasks in a table, or those named in words; return all about them."""
    names = flags["names"]
    tasks = [task_by_name(name) for name in names] or list(TASKS.values())
    if names:
        print("\n\n".join(map(_in_words, tasks)))
    else:
        print(_table(tasks).terminal() + NOTE.rstrip())
        for name, reason in WITHDRAWN.items():
            print(f"{name}: withdrawn, refused: {reason}")
    facts = {"tasks": [_record(task) for task in tasks], "withdrawn": dict(WITHDRAWN)}
    units = {"tasks": {"value": "each task's unit", "scores": "-", "failures": "-"}}
    return Content(facts=facts, units=units)


def _table(tasks: Sequence[TaskDefinition]) -> Table:
    """A row a task: returns, and the score of the best by hand."""
    columns = [
        Column("task", words=True),
        Column("asked", words=True),
        *map(Column, ("idle (0)", "by hand", "its score", "best known (1)", "at most")),
    ]
    rows = []
    for task in tasks:
        known, cells = known_of(task), ["", "", "", "", ""]
        if known is not None:
            cells = [
                f"{known.trivial.value:.4g}",
                f"{known.by_hand.value:.4g}",
                known.score_of(known.by_hand).shown(2),
                f"{known.best.value:.4g}",
                "" if known.bound is None else f"{known.bound.value:.4g}",
            ]
        rows.append([task.name, task.title, *cells])
    return Table(columns, rows)


def _in_words(task: TaskDefinition) -> str:
    """All about a task."""
    lines = [f"{task.name}: {task.title}", task.about, f"Gymnasium: {task.id}"]
    lines += [f"  {name} = {value}" for name, value in (task.choices | task.parameters).items()]
    known = known_of(task)
    if known is None:
        return "\n".join([*lines, "Nothing is known of it yet."])
    count = "1 episode" if known.episodes == 1 else f"{known.episodes} episodes, seeds 0, 1, ..."
    lines.append(f"Mean returns [{task.unit}] of {count}, and scores:")
    everybody = (known.trivial, *known.baselines, *known.planners, known.best)
    lines += [f"  {_line(known, one)}" for one in dict.fromkeys(everybody)]
    if known.learned is not None:
        returns = ", ".join(f"{one:.4g}" for one in known.learned.returns)
        lines.append(f"  {known.learned.how}: {returns}")
    lines.append(f"Best known, a score of 1: {known.how}.")
    if known.bound is not None:
        lines.append(f"Proved: {_bounded(known, known.bound)}, as {known.bound.reason}.")
    if known.assumed is not None:
        beaten = known.best.value > known.assumed.value
        lines.append(
            f"Proved under assumptions: {_bounded(known, known.assumed)}, by "
            f"{known.assumed.reason}."
            + (" The best known does not, and earns more." if beaten else "")
        )
    return "\n".join(lines)


def _bounded(known: Known, bound: Bound) -> str:
    return f"at most {bound.value:.4g}, a score of {known.scale.score(bound.value):.2f}"


def _line(known: Known, one: Earned) -> str:
    failures = f", {one.failures:.0%} fail" if one.failures else ""
    return f"{one.policy:<24}{one.value:10.4g}, score {known.score_of(one).shown(2)}{failures}"


def _record(task: TaskDefinition) -> Mapping[str, object]:
    """Everything, with scores beside the returns."""
    known = known_of(task)
    about = {"name": task.name, "id": task.id, "digest": task.digest, "machine": task.machine}
    about |= asdict(task)
    if known is None:
        return about | {"known": None}
    scores = {
        one.policy: known.score_of(one)._asdict() for one in (*known.baselines, *known.planners)
    }
    return about | {"known": asdict(known) | {"scores": scores}}
