"""All tasks by name."""

from __future__ import annotations

from stickslip.dynamics.plain_checks import require_choice
from stickslip.envs.tasks.biped import BIPED_TASKS
from stickslip.envs.tasks.definition import NAMESPACE, TaskDefinition
from stickslip.envs.tasks.ugv import UGV_TASKS

TASKS: dict[str, TaskDefinition] = {one.name: one for one in (*BIPED_TASKS, *UGV_TASKS)}
"""By name, the biped's first."""


def task_by_name(name: str) -> TaskDefinition:
    """The task of a name, with "stickslip/" before it or not. ValueError with the nearest one."""
    plain = name.removeprefix(NAMESPACE) if isinstance(name, str) else name
    require_choice("task", plain, TASKS)
    return TASKS[plain]
