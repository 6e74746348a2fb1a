"""Bounds and estimate of a task's best return."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.evaluation.evaluate import seeds_of
from stickslip.agents.evaluation.rollout import horizon
from stickslip.agents.optimum.replayed import Replay, replay, values_at
from stickslip.agents.protocol import Params, State
from stickslip.dynamics.checks import require_number
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.agents.evaluation.table import Interval
    from stickslip.agents.optimum.value_iteration import Solution

TOLERANCE = 0.02
"""Share of the highest return by which an estimate may miss what its policy earns."""


@dataclass(frozen=True)
class Known:
    """Bounds and estimate of the best policy's mean return over the same episodes.

    earned: the policy's own mean return, replayed in the environment: a lower bound of the optimum
    over these episodes, since there is a policy that earns it; over all starts its interval holds.
    ceiling: no policy earns more, by the reward's definition. estimate: what the grid says of the
    same starts, which bounds nothing. coarser: the same of a grid with half the cells, None where
    none was solved. falls: share of episodes that ended before their time. off_grid: share of all
    states that the grid does not cover; there its nearest node was asked. tolerance: see `holds`.
    """

    earned: Interval
    ceiling: float
    estimate: float
    coarser: float | None
    falls: Interval
    off_grid: float
    tolerance: float
    replay: Replay

    @property
    def lower_bound(self) -> float:
        """Of the optimum over these episodes."""
        return self.earned.value

    @property
    def upper_bound(self) -> float:
        """Of the optimum over any episodes."""
        return self.ceiling

    @property
    def refinement(self) -> float | None:
        """By how much the estimate changed when the cells were halved."""
        return None if self.coarser is None else abs(self.estimate - self.coarser)

    @property
    def holds(self) -> bool:
        """True if the policy earns what the grid says, within `tolerance` of the ceiling, and
        stays where the grid knows something. Only then is the estimate worth a mention."""
        missed = abs(self.estimate - self.earned.value)
        return missed <= self.tolerance * abs(self.ceiling) and self.off_grid == 0

    def _repr_html_(self) -> str:
        """The same in a notebook."""
        rows = [[part] for part in self.in_words().split("; ")]
        return Table([Column("Known", words=True)], rows).html()

    def in_words(self) -> str:
        """Text of what is proved, estimated and not known."""
        low, high = self.earned.low, self.earned.high
        spread = f" ({low:.2f} to {high:.2f} for the mean over all starts)"
        words = [
            f"proved: the optimum over these {len(self.replay.reward)} episodes is at least "
            f"{self.earned.value:.3f}{spread if np.isfinite(low) else ''}, which the policy earns, "
            f"and at most {self.ceiling:.3f}"
        ]
        finer = "" if self.refinement is None else f", {self.refinement:.3f} from half the cells'"
        if self.holds:
            words.append(f"estimated: {self.estimate:.3f}, the grid's value{finer}")
        else:
            words.append(
                f"not known: the grid says {self.estimate:.3f}{finer}, but its policy does not "
                "earn that"
            )
        words.append(f"{self.falls.value:.0%} of the episodes end before their time")
        if self.off_grid:
            words.append(f"{self.off_grid:.2%} of the states lie off the grid")
        return "; ".join(words)


def known(
    solution: Solution[State, Params],
    *,
    coarser: Solution[State, Params] | None = None,
    episodes: int = 48,
    seeds: Sequence[int] | None = None,
    tolerance: float = TOLERANCE,
) -> Known:
    """Replay a solution's policy over episodes of its own task, seeds 0, 1, ... unless given.

    coarser: a solution on a grid with half the cells, for the error of the estimate. The grid's
    values are those of `objective` "episode" with as many steps as an episode has; for any other
    solution ValueError.
    """
    require_number("tolerance", tolerance, low=0.0, accepted="finite, >= 0")
    policy, params = solution.policy, solution.params
    for one in (solution, coarser):
        if one is not None and (one.objective, one.values.sweeps) != ("episode", horizon(params)):
            raise ValueError(
                f"a solution for the objective {one.objective!r} with {one.values.sweeps} sweeps; "
                f"accepted: 'episode' with {horizon(params)}, the steps of an episode"
            )
    seeds = seeds_of(episodes, seeds)
    played = replay(policy, params, seeds)
    before = None
    if coarser is not None:
        found = values_at(coarser.policy, played.start, params)
        before = float(np.mean(np.asarray(found)))
    return Known(
        earned=played.earned,
        ceiling=policy.states.most(params) * horizon(params),
        estimate=float(np.mean(played.expected)),
        coarser=before,
        falls=played.falls,
        off_grid=float(np.mean(played.off_grid)),
        tolerance=float(tolerance),
        replay=played,
    )
