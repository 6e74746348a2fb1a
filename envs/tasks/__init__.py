"""The task ladder: fixed environments with ids, and what is known of each."""

from stickslip.envs.tasks.definition import TASKS, WITHDRAWN, TaskDefinition, task_by_name
from stickslip.envs.tasks.known import Known, Scale, known_of

__all__ = ["TASKS", "WITHDRAWN", "Known", "Scale", "TaskDefinition", "known_of", "task_by_name"]
