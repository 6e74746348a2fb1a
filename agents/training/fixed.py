"""Fields of a training configuration that a named task does not decide."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.dynamics.plain_checks import shown

if TYPE_CHECKING:
    from collections.abc import Iterable


def own_task(name: str, machine: str) -> str:
    """The task's plain name. ValueError for an unknown task, and for one of another machine."""
    from stickslip.envs.tasks.ladder import TASKS, task_by_name

    task = task_by_name(name)
    if task.machine != machine:
        own = [one.name for one in TASKS.values() if one.machine == machine]
        raise ValueError(
            f"task = {task.name!r} is of the {task.machine}, this configuration of the "
            f"{machine}; accepted: {', '.join(own) or 'none'}"
        )
    return task.name


def refuse_fixed(given: Iterable[str], task: str) -> None:
    """ValueError for fields that a task decides, if there are any."""
    if found := list(given):
        raise ValueError(
            f"{', '.join(found)} with task = {shown(task)}, whose definition says "
            f"{'it' if len(found) == 1 else 'them'} and never changes; accepted: one or the other"
        )
