"""The ladder: named tasks that never change, and what is known of the best scores on them."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.envs.tasks.definition import TaskDefinition
    from stickslip.envs.tasks.known import Known, known_of
    from stickslip.envs.tasks.ladder import TASKS, WITHDRAWN, task_by_name
    from stickslip.envs.tasks.scale import Scale
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "definition": ("TaskDefinition",),
            "known": ("Known", "known_of"),
            "ladder": ("TASKS", "WITHDRAWN", "task_by_name"),
            "scale": ("Scale",),
        },
    )

__all__ = [
    "TASKS",
    "WITHDRAWN",
    "Known",
    "Scale",
    "TaskDefinition",
    "known_of",
    "task_by_name",
]
