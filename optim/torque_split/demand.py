"""The least friction demand of one posture's splits: the least largest |F| / N of both wheels."""

from __future__ import annotations

import numpy as np

from stickslip.optim.result import OptimStatus
from stickslip.optim.torque_split.family import SplitData
from stickslip.optim.torque_split.program import Affine, SplitProgram, SplitSolution, interval

SHORTFALLS = (1e-9, 1e-8, 1e-7, 1e-6)
"""Relative distance of the trial bound below the least friction demand found."""


def least_demand(program: SplitProgram, setting: SplitData) -> SplitSolution:
    """The least t for which |F| <= t N at both wheels.

    Either ratio falls and then rises with the split, so the least of the larger one is where a
    friction force is none, where both ratios are the same, or at an end. From the best of these
    Dinkelbach's method for ratios goes on: at the t reached so far, the split with the least of
    max(|F| - t N) has a lower t, if there is one. A linear program whose dual value at some t is
    positive proves that no split gets by with that t. FAILED with a bound of -inf where t falls as
    long as the forces grow.
    """
    F, N = setting.forces()
    limits = setting.limits(grip=False)
    found = [d for d in candidates(F, N, *interval(limits)) if np.min(N.at(d)) > 0]
    if not found:
        return SplitSolution(np.nan, np.inf, np.inf, OptimStatus.INFEASIBLE)
    d = min(found, key=lambda at: _demand(F, N, at))
    demand, status = _demand(F, N, d), OptimStatus.OPTIMAL
    for _ in range(30):
        outcome = program.solve(setting.terms("friction_demand", demand), limits)
        status = outcome.status
        if status is OptimStatus.FAILED and outcome.bound == -np.inf:
            return SplitSolution(d, demand, -np.inf, status)
        if not np.isfinite(outcome.d) or np.min(N.at(outcome.d)) <= 0:
            break
        lower = _demand(F, N, outcome.d)
        if lower >= demand * (1 - 1e-15):
            break
        d, demand = outcome.d, lower
    bound = 0.0
    for shortfall in SHORTFALLS:
        tried = demand * (1 - shortfall)
        if program.solve(setting.terms("friction_demand", tried), limits).bound > 0:
            bound = tried
            break
    return SplitSolution(d, demand, bound, status)


def candidates(F: Affine, N: Affine, low: float, high: float) -> list[float]:
    """Candidates for the least larger ratio, from low to high, and a point between the ends; none
    where low > high."""
    if not low <= high:
        return []
    finite = [end for end in (low, high) if np.isfinite(end)]
    middle = sum(finite) / max(1, len(finite))
    if len(finite) == 1:  # a weight away from the only end
        middle += 1.0 if finite[0] == low else -1.0
    (rear, front), (n_rear, n_front) = (np.stack(of, -1)[:, ::-1] for of in (F, N))
    crossings = [
        np.roots(np.polymul(rear, n_front) - sign * np.polymul(front, n_rear)) for sign in (1, -1)
    ]
    roots = np.concatenate([np.roots(rear), np.roots(front), *crossings])
    places = [0.0, middle, *finite, *np.real(roots[np.isreal(roots)])]
    return [float(d) for d in places if low <= d <= high]


def _demand(F: Affine, N: Affine, d: float) -> float:
    return float(np.max(np.abs(F.at(d)) / N.at(d)))
