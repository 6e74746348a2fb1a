"""Shares: how much of p is charged where a step's cost is at its kink, max(0, p) with p about 0.

Any share from 0 to 1 is a bound; the best one is the multiplier of the kink. They begin from the
best drive known, and go up the bound's own slope: as a function of them it is a least of straight
lines, whose slope is what the path that attains it would be charged.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from stickslip.optim.posture.bounds.lowered import Term
    from stickslip.optim.posture.bounds.potentials import Step
    from stickslip.optim.posture.problem import PostureProblem

KINK = 1e-6
"""A cost within this part of the largest is at its kink."""
STRIDE = 0.7
"""Of the way that would close the gap, were the bound straight."""


def first_shares(problem: PostureProblem, terms: list[Term], x: np.ndarray | None) -> np.ndarray:
    """[K - 1, terms]: 1 where the drive x pays, 0 where it pays nothing, a half at a kink."""
    steps = len(problem.x) - 1
    if x is None:
        return np.ones((steps, len(terms)))
    at = problem.stations(x)
    fields = {
        "torque": at.torque,
        "turn": at.turn,
        "leg_rear": at.leg_torques[:, 0],
        "leg_front": at.leg_torques[:, 1],
        "rear": at.leg_angles[:, 0],
        "front": at.leg_angles[:, 1],
    }
    shares = np.ones((steps, len(terms)))
    for number, term in enumerate(terms):
        if term.Y is None:
            continue
        X, Y = fields[term.X], fields[term.Y]
        p = (X[:-1] + X[1:]) / 2 * np.diff(Y)
        small = KINK * max(float(np.max(np.abs(p))), 1e-300)
        shares[:, number] = np.where(p > small, 1.0, np.where(p < -small, 0.0, 0.5))
    return shares


def cheapest(steps: list[Step], to_go: list[np.ndarray]) -> list[tuple[int, int]]:
    """The corners of the path that attains the least cost to go."""
    i, j = np.unravel_index(np.argmin(to_go[0]), to_go[0].shape)
    path = [(int(i), int(j))]
    for step, after in zip(steps, to_go[1:], strict=True):
        i, j = path[-1]
        rows, columns = np.nonzero(step.rear[i])[0], np.nonzero(step.front[j])[0]
        rows, columns = (of.ravel() for of in np.meshgrid(rows, columns, indexing="ij"))
        here = (np.full(rows.shape, i), np.full(rows.shape, j))
        total = step.costs.between(here, (rows, columns)) + after[rows, columns]
        least = int(np.argmin(total))
        path.append((int(rows[least]), int(columns[least])))
    return path


def climbed(
    shares: np.ndarray, steps: list[Step], path: list[tuple[int, int]], gap: float
) -> np.ndarray:
    """Shares a stride up the slope, within 0 and 1."""
    slopes = np.zeros(shares.shape)
    for k, step in enumerate(steps):
        for number, term in enumerate(step.costs.terms):
            if term.Y is None:
                continue
            p, spread, kappa = step.costs.look(number, path[k], path[k + 1])
            if -spread < p < spread + kappa:
                slopes[k, number] = term.weight * (p - kappa)
    size = float(np.sum(slopes**2))
    if size == 0:
        return shares
    return np.clip(shares + STRIDE * max(gap, 0.0) * slopes / size, 0.0, 1.0)
