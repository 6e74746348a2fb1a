"""Bounds for sums over steps: costs to go over cells, and what cells a good drive may pass."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.posture.bounds.sides import Side
from stickslip.optim.posture.bounds.sweep import Step
from stickslip.optim.posture.bounds.terms import Term, terms_of
from stickslip.optim.posture.bounds.where import lossy, place

if TYPE_CHECKING:
    from stickslip.optim.posture.bounds.station_cells import StationCells
    from stickslip.optim.posture.problem import PostureProblem

CAP = 0.05
"""Margin above the best known cost up to which costs to go are kept."""


class Sums:
    """The bound of a sum over steps at one level after the other."""

    def __init__(self, problem: PostureProblem, x: np.ndarray | None):
        self.problem = problem
        self.x = np.zeros(0) if x is None else np.asarray(x, float)
        """The best drive known; none, and nothing is asked of it: see `least`."""
        self.terms = terms_of(problem.criterion)
        names = {name for term in self.terms for name in (term.X, term.Y) if name}
        self.fields = tuple(sorted(names - {"rear", "front"}))

    def bound(
        self, cells: list[StationCells], least: float, enough: float, tick: Callable[[], None]
    ) -> tuple[float, list[StationCells], np.ndarray]:
        """No drive through these cells costs less than the first; the second: those that a drive of
        `least` or less may pass; the third: at which waypoints they are worth halving. enough: a
        bound with which that is not asked for. tick: called once or twice for each waypoint."""
        every = np.ones(len(cells), bool)
        dead = [replace(of, alive=np.zeros_like(of.alive)) for of in cells]
        if not all(np.any(of.alive) for of in cells):
            return np.inf, dead, every
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
            return np.inf, dead, every
        if not np.isfinite(least) or bound >= enough:
            return bound, cells, every
        passed, arrived = [], _free(sides[0])
        for k, (of, side, left) in enumerate(zip(cells, sides, to_go[::-1], strict=True)):
            if k:
                arrived = steps[k - 1].on(arrived, cap)
                tick()
            through = np.min(arrived + left, axis=1).reshape(side.alive.shape)
            alive = np.zeros_like(of.alive)
            alive[side.box] = side.alive & (through <= least)
            passed.append(replace(of, alive=alive))
        return bound, passed, self._worth(sides, to_go[::-1], least)

    def _worth(self, sides: list[Side], to_go: list[np.ndarray], least: float) -> np.ndarray:
        """Waypoints at which the best known drive shows that costs to go are too low."""
        angles = self.x.reshape(-1, 2)
        left = []
        for side, values, at in zip(sides, to_go, angles, strict=True):
            cell, weights = place((side.rear, side.front), at)
            left.append(values[np.ravel_multi_index(cell, side.alive.shape)] @ weights)
        paid = [0.0]
        for k in range(len(angles) - 1):
            fields = self._stations
            cost = [
                term.cost(np.asarray(_product(term, fields, k)), float(np.diff(self.problem.x)[k]))
                for term in self.terms
            ]
            paid.append(paid[-1] + float(sum(cost)))
        left = np.minimum(np.nan_to_num(left, nan=0.0, posinf=least), least)
        return lossy(left, paid[-1] - np.asarray(paid))

    @cached_property
    def _stations(self) -> dict[str, np.ndarray]:
        """The fields of the best drive known."""
        at = self.problem.stations(self.x)
        legs, angles = np.asarray(at.leg_torques), np.asarray(at.leg_angles)
        return {
            "torque": np.asarray(at.torque), "turn": np.asarray(at.turn),
            "leg_rear": legs[:, 0], "leg_front": legs[:, 1],
            "rear": angles[:, 0], "front": angles[:, 1],
        }  # fmt: skip

    def _cap(self, steps: list[Step], least: float) -> float:
        """Cap on costs to go."""
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


def _product(term: Term, fields: dict[str, np.ndarray], k: int) -> float:
    X = fields[term.X]
    if term.Y is None:
        return float(X[k + 1] - X[k])
    return float((X[k] + X[k + 1]) * (fields[term.Y][k + 1] - fields[term.Y][k]) / 2)


def _free(side: Side) -> np.ndarray:
    """Nothing is left to pay, or was."""
    return np.where(side.alive.ravel()[:, None], np.zeros((1, 4)), np.inf)
