"""What runs come to: hits of targets, expected running times, distributions, profiles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

import numpy as np

from stickslip.agents.optimisers.merit import Target
from stickslip.dynamics.plain_checks import require_choice
from stickslip.optim.instances.catalogue import suite

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from jaxtyping import Float

    from stickslip.agents.optimisers.results import Run


Cost: TypeAlias = Literal["evaluations", "seconds"]
COSTS = ("evaluations", "seconds")
TARGETS = 10.0 ** np.linspace(2, -4, 31)
"""Gaps to the best known value, in parts of its size: five in each power of ten."""
LEVEL, DRAWS = 0.95, 1000


class Expected(NamedTuple):
    """Expected running time, with the interval of LEVEL from a bootstrap over runs; infinite where
    no run hit. successes, runs: how many did, of how many."""

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


def costs(run: Run, of: Cost) -> Float[np.ndarray, "rows"]:
    """Evaluations or seconds by row."""
    require_choice("of", of, COSTS)
    return np.asarray(getattr(run, of), float)


def hits(run: Run, targets: Float[np.ndarray, "T"], of: Cost) -> Float[np.ndarray, "T"]:
    """What had been spent when each gap was first reached; infinite where it was not. NaN where the
    table does not tell."""
    reached, spent = gaps(run), costs(run, of)
    met = reached[:, None] <= np.asarray(targets, float)[None, :]
    first = np.argmax(met, axis=0)
    return np.where(met.any(axis=0), spent[first], np.inf)


def ert(runs: Sequence[Run], target: float, of: Cost = "evaluations", seed: int = 0) -> Expected:
    """Expected running time to a gap: what all runs spent until they hit it or ended, over how many
    hit it (Auger and Hansen 2005), for runs of one method on one instance. A run that ended by
    itself is taken to be begun again. Its interval: percentiles over runs drawn with replacement;
    wide for few runs, and infinite above where draws have no success."""
    found = np.array([hits(run, np.array([target]), of)[0] for run in runs])
    hit, ends = np.isfinite(found), np.array([costs(run, of)[-1] for run in runs])
    spent = np.where(hit, found, ends)
    value = _ratio(spent.sum(), hit.sum())
    which = np.random.default_rng(seed).integers(len(runs), size=(DRAWS, len(runs)))
    drawn = np.sort(_ratio(spent[which].sum(axis=1), hit[which].sum(axis=1)))
    tail = (1 - LEVEL) / 2
    low, high = (drawn[round(share * (DRAWS - 1))] for share in (tail, 1 - tail))
    return Expected(float(value), float(low), float(high), int(hit.sum()), len(runs))


def _ratio(spent: np.ndarray, hit: np.ndarray) -> np.ndarray:
    return np.where(hit > 0, spent / np.maximum(hit, 1), np.inf)


def ecdf(
    runs: Iterable[Run], of: Cost, targets: Float[np.ndarray, "T"] = TARGETS
) -> tuple[Float[np.ndarray, "P"], Float[np.ndarray, "P"]]:
    """Of all pairs of run and target, the share hit by then: where it rises, and to what.

    Evaluations are divided by the instance's free numbers, as is usual; seconds are not.
    """
    each = []
    for run in runs:
        size = suite()[run.instance].n if of == "evaluations" else 1
        each.append(hits(run, targets, of) / size)
    if not each:
        return np.zeros(0), np.zeros(0)
    all_hits = np.sort(np.concatenate(each))
    known = np.isfinite(all_hits)
    return all_hits[known], (np.flatnonzero(known) + 1) / len(all_hits)


def profile(
    runs: Iterable[Run], target: float, of: Cost
) -> dict[str, tuple[Float[np.ndarray, "P"], Float[np.ndarray, "P"]]]:
    """Performance profiles (Dolan and More 2002) by method: within which factor of the best method,
    on how many of the instances that any method solved or not, its expected running time lies."""
    by: dict[str, dict[str, list[Run]]] = {}
    for run in runs:
        by.setdefault(run.method, {}).setdefault(run.instance, []).append(run)
    names = sorted({name for own in by.values() for name in own})
    times = {
        method: np.array([
            ert(own[name], target, of).value if name in own else np.inf for name in names
        ])
        for method, own in by.items()
    }  # fmt: skip
    best = np.min(np.array(list(times.values())), axis=0)
    found = {}
    for method, own in times.items():
        with np.errstate(invalid="ignore"):
            ratios = np.sort(np.where(np.isfinite(own), own / np.maximum(best, 1e-12), np.inf))
        known = np.isfinite(ratios)
        found[method] = ratios[known], (np.flatnonzero(known) + 1) / len(names)
    return found


def share_feasible(runs: Sequence[Run], at: Float[np.ndarray, "P"]) -> Float[np.ndarray, "P"]:
    """Of runs, the share that had a feasible point after so many evaluations per free number."""
    first = []
    for run in runs:
        known = np.flatnonzero(np.isfinite(run.values))
        size = suite()[run.instance].n
        first.append(run.evaluations[known[0]] / size if len(known) else np.inf)
    return np.mean(np.array(first)[:, None] <= at[None, :], axis=0)
