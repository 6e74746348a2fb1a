"""The best point that runs found of an instance, evaluated again and shown by its machine."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.registry import machines
from stickslip.optim.instances.catalogue import suite
from stickslip.optim.instances.instance import SAME

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from stickslip.agents.optimisers.results import Run
    from stickslip.envs.rendering.html.data import Shown

MOST_SHOWN = 6
"""Instances of a page: each may need programs of its own."""
PLAYED = ("posture", "gait", "shooting", "gains")
"""Families whose points are drives, gaits and walks."""


class Best(NamedTuple):
    """A point that was evaluated again. again: its value now. shown: what it does."""

    run: Run
    again: float
    feasible: bool
    shown: Shown

    @property
    def apart(self) -> float:
        """By how much it is worth more than was recorded."""
        return self.again - self.run.best

    @property
    def same(self) -> bool:
        """Whether it is feasible and of the recorded value, but for roundings."""
        return self.feasible and abs(self.apart) <= SAME * (1 + abs(self.run.best))


def best_of(
    runs: Iterable[Run], say: Callable[[str], None] = lambda stage: None
) -> tuple[list[Best], int]:
    """The best of some instances, and of how many more something could be shown.

    At most MOST_SHOWN, the first of every family before the second of any. say: told of each.
    """
    chosen = _in_turn(_least(runs))
    found = []
    for run in chosen[:MOST_SHOWN]:
        say(f"playing the best of {run.instance}, to be shown")
        if (one := _played(run)) is not None:
            found.append(one)
    return found, max(0, len(chosen) - MOST_SHOWN)


def _least(runs: Iterable[Run]) -> dict[str, Run]:
    """The run of least value by instance, of those whose point is known and can be played."""
    found: dict[str, Run] = {}
    for run in runs:
        if run.point is None or not np.isfinite(run.best):
            continue
        if suite()[run.instance].family in PLAYED:
            before = found.get(run.instance)
            found[run.instance] = run if before is None or run.best < before.best else before
    return found


def _in_turn(found: dict[str, Run]) -> Sequence[Run]:
    """Family by family in turn."""
    groups = [[run for name, run in found.items() if suite()[name].family == one] for one in PLAYED]
    longest = max(map(len, groups), default=0)
    return [group[i] for i in range(longest) for group in groups if i < len(group)]


def _played(run: Run) -> Best | None:
    instance = suite()[run.instance]
    problem = instance.problem
    if run.point is None:
        return None
    whole = problem.free.expand(run.point)
    name = f"{run.instance} by {run.method}"
    drawn = (one.solved(problem, whole, name) for one in machines())
    shown = next((one for one in drawn if one is not None), None)
    if shown is None:
        return None
    values, feasible = instance.value(run.point)
    return Best(run, float(values[0]), feasible, shown)
