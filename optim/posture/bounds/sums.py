"""Bounds for sums over steps: costs to go over corners, and what cells a good drive may pass."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.posture.bounds.lowered import terms_of
from stickslip.optim.posture.bounds.potentials import Step, back, make_step, missed, on
from stickslip.optim.posture.bounds.shares import cheapest, climbed, first_shares
from stickslip.optim.posture.bounds.station_cells import of_corners

if TYPE_CHECKING:
    from stickslip.optim.posture.bounds.station_cells import StationCells
    from stickslip.optim.posture.problem import PostureProblem

TURNS = 4
"""How often shares are moved at each level, at most."""


class Sums:
    """The bound of a sum over steps at one level after the other."""

    def __init__(self, problem: PostureProblem, x: np.ndarray | None):
        self.problem = problem
        self.terms = terms_of(problem.criterion)
        self.shares = first_shares(problem, self.terms, x)
        names = {name for term in self.terms for name in (term.X, term.Y) if name}
        self.fields = tuple(sorted(names - {"rear", "front"}))

    def bound(
        self, cells: list[StationCells], least: float, enough: float
    ) -> tuple[float, list[StationCells]]:
        """No drive through these cells costs less than the first; the second: those that a drive of
        `least` or less may pass. enough: a bound with which shares need not be better."""
        steps, to_go, bound = self._best(cells, least, enough)
        if not np.isfinite(bound):
            return bound, [replace(of, alive=np.zeros_like(of.alive)) for of in cells]
        lost = sum(
            missed(step, to_go[k], to_go[k + 1]) + step.costs.slack for k, step in enumerate(steps)
        )
        finite = [np.max(np.abs(of[np.isfinite(of)]), initial=0.0) for of in to_go]
        lost += 16 * np.finfo(float).eps * len(cells) * float(np.max(finite))
        if bound - lost >= enough:
            return bound - lost, cells
        return bound - lost, self._passed(cells, steps, to_go, least + lost)

    def _best(
        self, cells: list[StationCells], least: float, enough: float
    ) -> tuple[list[Step], list[np.ndarray], float]:
        """The steps with the best shares found, costs to go and the bound."""
        problem, shares = self.problem, self.shares
        steps = [
            make_step(problem, self.terms, k, a, b, list(shares[k]))
            for k, (a, b) in enumerate(pairwise(cells))
        ]
        best = (steps, *_to_go(steps, cells))
        if not np.isfinite(least):
            return best
        now = best
        for _ in range(TURNS):
            if not -np.inf < now[2] < enough:
                break
            path = cheapest(now[0], now[1])
            shares = climbed(shares, now[0], path, least - now[2])
            steps = [
                step._replace(costs=replace(step.costs, shares=list(shares[k])))
                for k, step in enumerate(steps)
            ]
            now = (steps, *_to_go(steps, cells))
            if now[2] > best[2]:
                best, self.shares = now, shares
        return best

    def _passed(
        self, cells: list[StationCells], steps: list[Step], to_go: list[np.ndarray], least: float
    ) -> list[StationCells]:
        if not np.isfinite(least):
            return cells
        passed, arrived = [], np.where(cells[0].corners, 0.0, np.inf)
        for k, of in enumerate(cells):
            if k:
                arrived = on(steps[k - 1], arrived, of.corners)
            through = of_corners(arrived + to_go[k], np.minimum)
            passed.append(replace(of, alive=of.alive & (through <= least)))
        return passed


def _to_go(steps: list[Step], cells: list[StationCells]) -> tuple[list[np.ndarray], float]:
    """Costs to go at the corners of every waypoint, and the least at the first."""
    found = [np.where(cells[-1].corners, 0.0, np.inf)]
    for step, of in zip(steps[::-1], cells[-2::-1], strict=True):
        found.append(back(step, found[-1], of.corners))
    return found[::-1], float(np.min(found[-1]))
