"""Playing a few of a sweep's episodes again, all of each, by the sweep's own programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import numpy as np

from stickslip.agents.sweeps.playing.case import marks_of
from stickslip.agents.sweeps.playing.program import Programs, Tile

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jaxtyping import PyTree

    from stickslip.agents.evaluation.rollout import AnyRollout
    from stickslip.agents.sweeps.plan import Plan
    from stickslip.agents.sweeps.playing.case import Case
    from stickslip.agents.sweeps.telling.chosen import Chosen

MOST_STEPS = 100_000
"""Of an episode that is played again: all its states are held."""


class Again(NamedTuple):
    """An episode as it came out again. params: of its point. axes: their values there, by name.
    earned: its return."""

    chosen: Chosen
    case: Case
    params: PyTree
    axes: dict[str, float]
    played: AnyRollout
    earned: float

    @property
    def apart(self) -> float | None:
        """By how much it earned more than was recorded; None where nothing was."""
        told = self.chosen.recorded
        return None if told is None else self.earned - told

    @property
    def rounding(self) -> float:
        """What the sum of its rewards may be apart by for the order of its terms alone."""
        rewards = np.asarray(self.played.trimmed().reward)
        size = max(1.0, float(np.sum(np.abs(rewards), dtype=float)))
        return float(np.finfo(rewards.dtype).eps) * float(np.sqrt(self.case.steps)) * size


def play_again(plan: Plan, chosen: Sequence[Chosen]) -> list[Again]:
    """Play episodes from their points and seeds, in their order; a program for each case.

    The program gives out all states, which the sweep's did not, and is compiled otherwise for it:
    steps may differ by roundings, and a walk may make these large. `Again.apart` tells.
    Cases whose episodes may take more than MOST_STEPS steps are left out. MemoryError where not one
    fits.
    """
    measures = plan.machine.task_measures(plan.cases[0].env)

    def keep(played: PyTree, params: PyTree) -> PyTree:
        return played, measures.keep(played, params).reward

    programs, found = Programs(plan.machine.swept(), keep, plan.independent), {}
    for index in dict.fromkeys(one.case for one in chosen):
        case = plan.cases[index]
        if case.steps > MOST_STEPS:
            continue
        mine = [one for one in chosen if one.case == index]
        played, earned = programs.play(case, case.place, _tile(plan, case, mine))
        for i, one in enumerate(mine):
            axes = _axes(plan, one)
            numbers = {field: axes[name] for name in axes for field in case.fields[name]}
            params = plan.machine.swept().put(case.params, numbers)
            row = jax.tree.map(lambda leaf, i=i: leaf[i], played)
            found[one.episode] = Again(one, case, params, axes, row, float(earned[i]))
    return [found[one.episode] for one in chosen if one.episode in found]


def _axes(plan: Plan, one: Chosen) -> dict[str, float]:
    here = plan.design.at(one.point, one.point + 1)
    return {name: float(values[0]) for name, values in here.items()}


def _tile(plan: Plan, case: Case, chosen: Sequence[Chosen]) -> Tile:
    """The episodes side by side, each at a point of its own."""
    each = [_axes(plan, one) for one in chosen]
    here = {name: np.asarray([axes[name] for axes in each]) for name in plan.design.axes}
    count = len(chosen)
    marks = marks_of(here, count) if plan.independent else np.zeros(count)
    return Tile(
        {field: here[name] for name in here for field in case.fields[name]},
        marks.astype(np.uint32),
        np.arange(count, dtype=np.int32),
        np.asarray([one.seed for one in chosen], np.uint32),
    )
