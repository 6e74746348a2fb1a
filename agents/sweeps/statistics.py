"""Summary of a sweep's policies, compared by paired 95 % intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from stickslip.agents.sweeps.data import SweepArrays

Z95 = 1.96
LEAST_DISTANCE = 0.1
"""Mean distance below which no slip per metre is given [m]."""


def summary_table(found: SweepArrays, slip: tuple[str, str] | None = None) -> Table:
    """A row for each task and policy, over all its points.

    point_mean_least, point_mean_most: of the means at single points. failures: share of episodes.
    best: share of points where its mean return is significantly the greatest. slip_worst: slip
    per distance travelled at the worst point.
    """
    heads = [Column(name, words=True) for name in ("task", "policy")]
    heads += [Column("points"), Column("episodes"), Column("return_mean")]
    heads += [Column("point_mean_least"), Column("point_mean_most"), Column("failures")]
    heads += [Column("best")] + ([] if slip is None else [Column("slip_worst", "m/m")])
    returns, policies = found["reward"].astype(float), found.coordinates["policy"]
    means, slid = returns.mean(axis=-1), slip_of(found, slip)
    rows = []
    for t, task in enumerate(found.coordinates["task"]):
        best = best_of(found, t) if len(policies) > 1 else None
        for p, policy in enumerate(policies):
            here, fell = means[t, p], found["fell"][t, p]
            row = [str(task), str(policy), here.size, returns[t, p].size, float(here.mean())]
            row += [float(here.min()), float(here.max()), float(fell.mean())]
            row.append(None if best is None else float(np.mean(best == p)))
            if slid is not None:
                known = slid[t, p][np.isfinite(slid[t, p])]
                row.append(float(known.max()) if known.size else None)
            rows.append(row)
    return Table(heads, rows)


def slip_of(found: SweepArrays, slip: tuple[str, str] | None) -> np.ndarray | None:
    """Slip per distance travelled at every point; NaN where nothing moves."""
    if slip is None:
        return None
    slid, distance = (np.abs(found[name].astype(float)).mean(axis=-1) for name in slip)
    moves = distance >= LEAST_DISTANCE
    return np.where(moves, slid / np.where(moves, distance, 1.0), np.nan)


def half_width(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Half-width of the 95 % interval of the difference of two mean returns at every point.

    one, other: returns [..., episodes], paired by their seeds. Infinite for one episode.
    """
    count = one.shape[-1]
    if count < 2:
        return np.full(one.shape[:-1], np.inf)
    return Z95 * (other.astype(float) - one).std(axis=-1, ddof=1) / np.sqrt(count)


def best_of(found: SweepArrays, task: int) -> np.ndarray:
    """Index of the policy with the greatest mean return at every point of a task; -1 where the
    difference from the next one is not significant."""
    returns = found["reward"][task].astype(float)
    order = np.argsort(-returns.mean(axis=-1), axis=0, kind="stable")
    first, second = (np.take_along_axis(returns, order[i : i + 1, ..., None], 0)[0] for i in (0, 1))
    lead = first.mean(axis=-1) - second.mean(axis=-1)
    needed = half_width(first, second) if is_random(found, task) else 0.0
    return np.where(lead > needed, order[0], -1)


def is_random(found: SweepArrays, task: int) -> bool:
    """True if a task's resets draw."""
    return str(found.coordinates["task"][task]) in found.random
