"""The ladder: named tasks that never change, and what is known of the best scores on them."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.envs.tasks.definition import TASKS, WITHDRAWN, TaskDefinition, task_by_name
    from stickslip.envs.tasks.known import Known, Scale, known_of
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "definition": ("TASKS", "WITHDRAWN", "TaskDefinition", "task_by_name"),
            "known": ("Known", "Scale", "known_of"),
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
