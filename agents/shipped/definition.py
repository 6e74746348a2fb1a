"""True if a policy's named task is still the one that it was trained on."""

from __future__ import annotations

from importlib.metadata import version
from typing import TYPE_CHECKING

from stickslip.agents.foreign.reading import RefusedError
from stickslip.dynamics.plain_checks import nearest, shown
from stickslip.envs.tasks.definition import TASKS, WITHDRAWN, withdrawal

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.agents.foreign.reading import Json
    from stickslip.envs.tasks.definition import TaskDefinition

NAMED = "named_task"
"""The entry of a policy's metadata that holds the task's name and digest."""
KEPT = ("name", "digest")
DIGITS = 12
"""Of a digest, to be shown."""


def named_task_entry(task: TaskDefinition) -> dict[str, Json]:
    """Entry of a policy's file about the named task that it was trained on."""
    return {NAMED: {"name": task.name, "digest": task.digest}}


def named_task_of(metadata: Mapping[str, Json]) -> TaskDefinition | None:
    """The named task of a policy; None where its file names none.

    RefusedError where the task is unknown here, or another one than it was: a task never changes
    under its name, so such a file is of another version of stickslip, or it was tampered with.
    """
    entry = metadata.get(NAMED)
    if entry is None:
        return None
    if not isinstance(entry, dict) or not all(isinstance(entry.get(one), str) for one in KEPT):
        raise RefusedError(f"{NAMED} is {shown(entry)}, no name with a digest")
    name, digest = (str(entry[one]) for one in KEPT)
    here = f"stickslip {version('stickslip')}"
    whose = f"a policy of the task {shown(name)}, saved by stickslip {_version(metadata)}"
    if name in WITHDRAWN:
        raise RefusedError(f"{whose}; {withdrawal(name)}, or the version that it came with")
    if name not in TASKS:
        raise RefusedError(
            f"{whose}; {here} has no such task{nearest(name, TASKS)}; accepted: "
            "a policy of a task that it has (`stickslip tasks`), or the version that it came with"
        )
    task = TASKS[name]
    if digest != task.digest:
        raise RefusedError(
            f"{whose}, whose definition is {shown(digest[:DIGITS])}; the {name} of "
            f"{here} is {task.digest[:DIGITS]}; accepted: a policy trained on this one "
            f"(`stickslip train --task {name}`), or the version that it came with"
        )
    return task


def _version(metadata: Mapping[str, Json]) -> str:
    versions = metadata.get("versions")
    found = versions.get("stickslip") if isinstance(versions, dict) else None
    return found if isinstance(found, str) else "of an unknown version"
