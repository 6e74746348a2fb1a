"""Gaps, first hits of targets, expected running times and their distributions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

import numpy as np

from stickslip.dynamics.plain_checks import require_choice
from stickslip.optim.instances.catalogue import suite

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from jaxtyping import Float

    from stickslip.agents.optimisers.results import Run
    from stickslip.optim.instances.instance import Instance

Cost: TypeAlias = Literal["evaluations", "seconds"]
COSTS: tuple[Cost, Cost] = ("evaluations", "seconds")
TARGETS = 10.0 ** np.linspace(2, -4, 31)
"""Relative gaps to the best known value: five in each power of ten."""
LEVEL, RESAMPLES = 0.95, 1000
LEAST, REFERENCE = 1e-12, 1.1


class Target(NamedTuple):
    """The best known value, and the size that gaps are relative to."""

    best: float
    scale: float

    @classmethod
    def of(cls, instance: Instance) -> Target:
        """The target of an instance; with several goals 0 and 1, see `front_merit`."""
        if len(instance.goals) > 1:
            return cls(0.0, 1.0)
        return cls(instance.best_known, max(abs(instance.best_known), LEAST))

    def gap(self, value: float | np.ndarray) -> np.ndarray:
        """(value - best) / scale: 0 for the best known, negative for what is better."""
        return (np.asarray(value, float) - self.best) / self.scale


def front_merit(instance: Instance, values: Float[np.ndarray, "B 2"]) -> float:
    """Share of the known front's hypervolume that points miss; goals are scaled to 0 and 1 on the
    front, and the reference point is (1.1, 1.1)."""
    front = None if instance.known is None else instance.known.front
    if front is None or front.shape[1] != 2:
        raise ValueError(f"{instance.id}: no front of two goals is known")
    low, high = front.min(axis=0), front.max(axis=0)
    found, known = (hypervolume((one - low) / (high - low), REFERENCE) for one in (values, front))
    return 1.0 - found / known


def hypervolume(values: Float[np.ndarray, "B 2"], reference: float) -> float:
    """The area that points of two goals, both minimised, dominate up to (reference, reference)."""
    inside = values[np.all(values < reference, axis=1)]
    area, least = 0.0, reference
    for first, second in inside[np.lexsort((inside[:, 1], inside[:, 0]))]:
        if second < least:
            area += (reference - first) * (least - second)
            least = second
    return float(area)


class Expected(NamedTuple):
    """Expected running time with a bootstrap interval of LEVEL over runs; infinite where no run
    hit. successes, runs: how many did, of how many."""

    value: float
    low: float
    high: float
    successes: int
    runs: int


def gaps(run: Run) -> Float[np.ndarray, "rows"]:
    """(value - best known) / |best known| by row; infinite before something is feasible. With two
    goals: the missing share of hypervolume."""
    found = Target.of(suite()[run.instance]).gap(run.values)
    return np.where(np.isfinite(found), found, np.inf)


def hits(run: Run, targets: Float[np.ndarray, "T"], of: Cost) -> Float[np.ndarray, "T"]:
    """Cost at which each gap was first reached; infinite where it was not."""
    require_choice("of", of, COSTS)
    met = gaps(run)[:, None] <= np.asarray(targets, float)[None, :]
    spent = np.asarray(getattr(run, of), float)
    return np.where(met.any(axis=0), spent[np.argmax(met, axis=0)], np.inf)


def ert(runs: Sequence[Run], target: float, of: Cost = "evaluations", seed: int = 0) -> Expected:
    """Expected running time to a gap: what all runs spent until they hit it or ended, over the
    number of hits (Auger and Hansen 2005), for runs of one method on one instance. Wide for few
    runs, and infinite above where resamples have no success."""
    found = np.array([hits(run, np.array([target]), of)[0] for run in runs])
    hit, ends = np.isfinite(found), np.array([float(getattr(run, of)[-1]) for run in runs])
    spent = np.where(hit, found, ends)
    which = np.random.default_rng(seed).integers(len(runs), size=(RESAMPLES, len(runs)))
    drawn = np.sort(_ratio(spent[which].sum(axis=1), hit[which].sum(axis=1)))
    tail = (1 - LEVEL) / 2
    low, high = (drawn[round(share * (RESAMPLES - 1))] for share in (tail, 1 - tail))
    value = _ratio(spent.sum(), hit.sum())
    return Expected(float(value), float(low), float(high), int(hit.sum()), len(runs))


def _ratio(spent: np.ndarray, hit: np.ndarray) -> np.ndarray:
    return np.where(hit > 0, spent / np.maximum(hit, 1), np.inf)


def ecdf(
    runs: Iterable[Run], of: Cost, targets: Float[np.ndarray, "T"] = TARGETS
) -> tuple[Float[np.ndarray, "P"], Float[np.ndarray, "P"]]:
    """Share of all pairs of run and target hit by a cost: where it rises, and to what.

    Evaluations are divided by the instance's free numbers, as is usual; seconds are not.
    """
    each = [hits(run, targets, of) / scale_of(run, of) for run in runs]
    if not each:
        return np.zeros(0), np.zeros(0)
    ordered = np.sort(np.concatenate(each))
    known = np.isfinite(ordered)
    return ordered[known], (np.flatnonzero(known) + 1) / len(ordered)


def scale_of(run: Run, of: Cost) -> int:
    """Scale of the costs in an ECDF."""
    return suite()[run.instance].n if of == "evaluations" else 1
