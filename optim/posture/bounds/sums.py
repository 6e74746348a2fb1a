"""Bounds for sums over steps: costs to go over cells, and what cells a good drive may pass."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.posture.bounds.sides import Side
from stickslip.optim.posture.bounds.sweep import Step
from stickslip.optim.posture.bounds.terms import terms_of

if TYPE_CHECKING:
    from stickslip.optim.posture.bounds.station_cells import StationCells
    from stickslip.optim.posture.problem import PostureProblem

CAP = 0.05
"""Of the best known: by how much more costs to go are looked at."""


class Sums:
    """The bound of a sum over steps at one level after the other."""

    def __init__(self, problem: PostureProblem):
        self.problem = problem
        self.terms = terms_of(problem.criterion)
        names = {name for term in self.terms for name in (term.X, term.Y) if name}
        self.fields = tuple(sorted(names - {"rear", "front"}))

    def bound(
        self, cells: list[StationCells], least: float, enough: float, tick: Callable[[], None]
    ) -> tuple[float, list[StationCells]]:
        """No drive through these cells costs less than the first; the second: those that a drive of
        `least` or less may pass. enough: a bound with which that is not asked for. tick: called
        once or twice for each waypoint."""
        dead = [replace(of, alive=np.zeros_like(of.alive)) for of in cells]
        if not all(np.any(of.alive) for of in cells):
            return np.inf, dead
        sides = [Side.of(one, self.terms) for one in cells]
        steps = [
            Step.of(self.problem, self.terms, k, a, b) for k, (a, b) in enumerate(pairwise(sides))
        ]
        cap = self._cap(steps, least)
        to_go = [_free(sides[-1])]
        for step in steps[::-1]:
            to_go.append(step.back(to_go[-1], cap))
            tick()
        bound = float(np.min(to_go[-1]))
        if not np.isfinite(bound):
            return np.inf, dead
        if not np.isfinite(least) or bound >= enough:
            return bound, cells
        passed, arrived = [], _free(sides[0])
        for k, (of, side, left) in enumerate(zip(cells, sides, to_go[::-1], strict=True)):
            if k:
                arrived = steps[k - 1].on(arrived, cap)
                tick()
            through = np.min(arrived + left, axis=1).reshape(side.alive.shape)
            alive = np.zeros_like(of.alive)
            alive[side.box] = side.alive & (through <= least)
            passed.append(replace(of, alive=alive))
        return bound, passed

    def _cap(self, steps: list[Step], least: float) -> float:
        """What costs to go are not looked at above."""
        size = 0.0
        for step in steps:
            for term in step.terms:
                X, U = (float(np.max(of.fields[term.X].over.size)) for of in step.ends)
                way = X + U
                if term.Y is not None:
                    Y, V = (of.fields[term.Y].over for of in step.ends)
                    way = float(max(np.max(V.hi) - np.min(Y.lo), np.max(Y.hi) - np.min(V.lo)))
                size += float(term.cost(np.asarray((X + U) * way / 2 if term.Y else way), step.dx))
        return least + CAP * least + 1e-6 * size if np.isfinite(least) else 1.0 + 2 * size


def _free(side: Side) -> np.ndarray:
    """Nothing is left to pay, or was."""
    return np.where(side.alive.ravel()[:, None], np.zeros((1, 4)), np.inf)
