"""All tasks by name, and the versions that are no tasks any more."""

from __future__ import annotations

from stickslip.dynamics.plain_checks import require_choice
from stickslip.envs.tasks.biped import BIPED_TASKS, BIPED_WITHDRAWN
from stickslip.envs.tasks.definition import NAMESPACE, TaskDefinition
from stickslip.envs.tasks.ugv import UGV_TASKS, UGV_WITHDRAWN

TASKS: dict[str, TaskDefinition] = {one.name: one for one in (*BIPED_TASKS, *UGV_TASKS)}
"""Task definitions by name, the biped's first."""
WITHDRAWN: dict[str, str] = {**BIPED_WITHDRAWN, **UGV_WITHDRAWN}
"""Reasons of withdrawn versions, by name. They are listed and refused."""


def task_by_name(name: str) -> TaskDefinition:
    """The task of a name, with "stickslip/" before it or not. ValueError with the nearest one, and
    for a withdrawn version with the reason."""
    plain = name.removeprefix(NAMESPACE) if isinstance(name, str) else name
    if isinstance(plain, str) and plain in WITHDRAWN:
        raise ValueError(f"task = {withdrawal(plain)}")
    require_choice("task", plain, TASKS)
    return TASKS[plain]


def withdrawal(name: str) -> str:
    """Reason of a withdrawn version, and the version that is accepted in its place."""
    stem = name.rpartition("-v")[0]
    latest = [task.name for task in TASKS.values() if task.stem == stem]
    return f"{name} is withdrawn: {WITHDRAWN[name]}; accepted: {', '.join(latest) or 'no other'}"
