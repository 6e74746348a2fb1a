"""The task that a policy was made for, as its file keeps it.

A description says in plain words what a reader wants to know, and holds under "task" every part
from which the same environment and parameters are built again.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import jax
import numpy as np

from stickslip.agents.tasks.values import from_json, to_json
from stickslip.agents.untrusted import LARGEST_TEXT, RefusedError, refusing
from stickslip.dynamics.checks import require_kind

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from stickslip.agents.untrusted import Json


class HasParams(Protocol):
    """Protocol of objects with their environment's parameters."""

    def params(self) -> object:
        """Built anew; ValueError where they will not do."""
        ...


Task = TypeVar("Task", bound=HasParams)

TASK = "task"
LONGEST = LARGEST_TEXT - 2**16
"""Characters of a task; what is longer is left out of the file, which then says so."""


def plain(value: Any) -> Json:
    """JSON values from arrays, tuples and dataclasses' contents, for people to read."""
    if isinstance(value, dict):
        return {name: plain(entry) for name, entry in value.items()}
    if isinstance(value, tuple | list):
        return [plain(entry) for entry in value]
    if hasattr(value, "dtype"):
        return np.asarray(value).tolist()
    return value


def in_words(value: Json) -> str:
    """A number with four digits, a list of them in brackets, for people to read."""
    if isinstance(value, list):
        return f"[{', '.join(map(in_words, value))}]"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def task_entry(**parts: object) -> dict[str, Json]:
    """The entry of a description that holds a task's parts, or says why it does not."""
    try:
        content: Json = {name: to_json(part) for name, part in parts.items()}
    except ValueError as error:
        return {TASK: None, "task_missing": str(error)}
    if (length := len(json.dumps(content))) > LONGEST:
        return {TASK: None, "task_missing": f"its {length} characters are too many"}
    return {TASK: content}


def read_parts(metadata: Mapping[str, Json], names: tuple[str, ...]) -> dict[str, Any] | None:
    """The parts of a description's task; None where it has none, as files of old.

    RefusedError for one that is damaged.
    """
    content = metadata.get(TASK)
    if content is None:
        return None
    with refusing("its task"):
        if not isinstance(content, dict) or set(content) != set(names):
            raise RefusedError(f"its task is not made of {', '.join(names)}")
        return {name: from_json(content[name]) for name in names}


def rebuilt_task(
    metadata: Mapping[str, Json],
    build: Callable[..., Task],
    names: tuple[str, ...],
    kinds: Mapping[str, type],
    numbers: Collection[str],
    optional: Collection[str] = (),
) -> Task | None:
    """The task in a policy's metadata; None where it has none. ValueError for a damaged one.

    build: makes it of its parts, `names`, which are of these kinds; numbers: what its part of that
    name holds, optional: what it may hold beside.
    """
    parts = read_parts(metadata, names)
    if parts is None:
        return None
    with refusing("its task"):
        for name, kind in kinds.items():
            require_kind(name, parts[name], kind, f"a {kind.__name__}")
        given = parts["numbers"]
        if not isinstance(given, dict) or set(given) - set(optional) != set(numbers):
            raise RefusedError(f"its task's numbers are not {', '.join(numbers)}")
        task = build(**parts)
        task.params()  # for what only the environment knows
        return task


def same_numbers(one: object, other: object) -> bool:
    """True if two trees hold the same numbers, up to rounding to float32."""
    if jax.tree.structure(one) != jax.tree.structure(other):
        return False
    pairs = zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True)
    return all(np.array_equal(np.float32(a), np.float32(b)) for a, b in pairs)
