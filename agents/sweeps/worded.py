"""What is said of a task whose numbers axes set: no more than what holds at every point."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.agents.machine import AnyMachine, AnyTask
    from stickslip.agents.protocol import AnyEnv, Timed
    from stickslip.agents.sweeps.design import Design

BETWEEN = re.compile(r", (?![^\[]*\])")
"""Of words; not within a list of numbers."""


class Worded(NamedTuple):
    """A task's label and details without what axes replace, and what of the label they do."""

    label: str
    details: str
    replaced: tuple[str, ...] = ()


def worded(
    machine: AnyMachine, env: AnyEnv, params: Timed, design: Design, label: str, details: str
) -> Worded:
    """What is left of a task's label and details where a design's axes set some of it.

    The task is described as it is and at both ends of all axes: what is not said at either end is
    left out. Where one of them is no task, which is said elsewhere, all is left as it is.
    """
    swept = machine.swept()
    try:
        own = _described(machine, env, params)
        opened = swept.opened(params, design.axes)
        fields = {name: swept.targets(opened, name) for name in design.axes}
        ends = []
        for end in (0, 1):
            values = {n: axis.ends[end] for n, axis in design.axes.items()}
            numbers = {one: value for n, value in values.items() for one in fields[n]}
            ends.append(_described(machine, env, swept.put(opened, numbers)))
    except ValueError:
        return Worded(label, details)
    if own is None or ends[0] is None or ends[1] is None:
        return Worded(label, details)
    left = [
        [word for word in first if word in last]
        for first, last in zip(ends[0], ends[1], strict=True)
    ]
    lost = [[w for w in words if w not in kept] for words, kept in zip(own, left, strict=True)]
    same = own[0] == _words(label)
    kept = left[0] if same else [word for word in _words(label) if word not in lost[0]]
    kept_details = [word for word in _words(details) if word not in lost[1]]
    replaced = [word for word in lost[0] if not any(word in one for one in left[0])]
    return Worded(", ".join(kept), ", ".join(kept_details), tuple(replaced))


def _described(
    machine: AnyMachine, env: AnyEnv, params: Timed
) -> tuple[list[str], list[str]] | None:
    """The words of the label and of the details; None where parameters do not tell a task."""
    described: Mapping[str, object] = machine.describe(env, params)
    task: AnyTask | None = machine.read_task(described)
    return None if task is None else (_words(task.label(None)), _words(task.details()))


def _words(text: str) -> list[str]:
    return [word for word in BETWEEN.split(text) if word]
