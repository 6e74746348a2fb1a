"""Bounds for worst stations: what no posture of a cell goes below, and the least worst path."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.posture.bounds.friction import most_friction
from stickslip.optim.posture.bounds.lattice import NONE, shapes
from stickslip.optim.posture.bounds.station_cells import of_corners
from stickslip.optim.posture.bounds.where import bottleneck, place
from stickslip.optim.posture.criteria import LEAST_NORMAL

if TYPE_CHECKING:
    from jaxtyping import Float, Int

    from stickslip.optim.posture.bounds.station_cells import StationCells
    from stickslip.optim.posture.problem import PostureProblem

NAMES = ("peak_torque", "grip", "normal_force", "friction_demand")


def at_least(name: str, of: StationCells, mu: Float[np.ndarray, "2"]) -> np.ndarray:
    """The criterion's cost of a station, a number it is not below in each cell; mu: of the rear and
    the front wheel, at most."""
    if name == "peak_torque":
        found = np.maximum(of.at_least("torque", 1), of.at_least("torque", -1))
        found = np.maximum(found, 0.0)
    elif name == "normal_force":
        found = np.maximum(of.at_least("N_rear", -1), of.at_least("N_front", -1))
    elif name == "grip":
        found = np.max(
            [
                _missing(of, wheel, sign, float(mu[i]))
                for i, wheel in enumerate(("N_rear", "N_front"))
                for sign in (1, -1)
            ],
            axis=0,
        )
    else:
        F = of.range_of("F").least_size
        N = np.minimum(-of.at_least("N_rear", -1), -of.at_least("N_front", -1))
        found = F / np.maximum(N, LEAST_NORMAL) * (1 - 1e-12)
    floor = 0.0 if name in ("peak_torque", "friction_demand") else -np.inf
    found = np.where(np.isnan(found), floor, np.maximum(found, floor))
    return np.where(of.alive, found, np.inf)


def _missing(of: StationCells, wheel: str, sign: int, mu: float) -> np.ndarray:
    """sign F - mu N."""
    corners = of_corners(sign * of.values["F"] - mu * of.values[wheel], np.minimum)
    return corners - of.bulge("F", sign) - mu * of.bulge(wheel, -1)


def carried(
    costs: np.ndarray, legs: tuple[Int[np.ndarray, "n m"], Int[np.ndarray, "n m"]]
) -> np.ndarray:
    """Least value, for each cell of the neighbouring waypoint, of those that a move may lead to or
    from; legs: of each leg, by the cells of that waypoint and of this one, see shapes."""
    for axis, shape in enumerate(legs):
        some = shape != NONE
        first = np.argmax(some, axis=1)
        past = some.shape[1] - np.argmax(some[:, ::-1], axis=1)
        best = [
            np.min(np.take(costs, range(i, j), axis), axis, initial=np.inf) if any_ else
            np.full(costs.shape[1 - axis], np.inf)
            for i, j, any_ in zip(first, past, np.any(some, axis=1), strict=True)
        ]  # fmt: skip
        costs = np.stack(best, axis)
    return costs


class Worst:
    """The bound of a worst station at one level after the other: of all paths of cells that the
    rate may allow the one whose worst cell is least."""

    fields = ("torque", "F", "N_rear", "N_front")

    def __init__(self, problem: PostureProblem, x: np.ndarray | None):
        self.problem, self.x = problem, x
        self.friction = most_friction(problem)
        name = problem.criterion.name
        if name not in NAMES:
            raise ValueError(f"criterion = {name}; accepted: {', '.join(NAMES)}, and sums")

    def bound(
        self, cells: list[StationCells], least: float, enough: float, tick: Callable[[], None]
    ) -> tuple[float, list[StationCells], np.ndarray]:
        """See Sums.bound."""
        name = self.problem.criterion.name
        costs = [at_least(name, of, self.friction[k]) for k, of in enumerate(cells)]
        legs = [
            (shapes(self.problem, k, a.rear, b.rear), shapes(self.problem, k, a.front, b.front))
            for k, (a, b) in enumerate(pairwise(cells))
        ]
        arrived, to_go = [costs[0]], [costs[-1]]
        for k, cost in enumerate(costs[1:]):
            back = (legs[k][0].T, legs[k][1].T)
            arrived.append(np.maximum(cost, carried(arrived[-1], back)))
            tick()
        for k in range(len(costs) - 2, -1, -1):
            to_go.append(np.maximum(costs[k], carried(to_go[-1], legs[k])))
            tick()
        passed = [
            replace(of, alive=of.alive & (np.maximum(a, b) <= least))
            for of, a, b in zip(cells, arrived, to_go[::-1], strict=True)
        ]
        bound = float(np.min(arrived[-1]))
        return bound, passed, self._worth(cells, costs, bound)

    def _worth(
        self, cells: list[StationCells], costs: list[np.ndarray], bound: float
    ) -> np.ndarray:
        if self.x is None or not np.isfinite(bound):
            return np.ones(len(cells), bool)
        angles = np.asarray(self.x, float).reshape(-1, 2)
        at = [
            cost[tuple(place((of.rear, of.front), pair)[0])]
            for of, cost, pair in zip(cells, costs, angles, strict=True)
        ]
        return bottleneck(np.where(np.isfinite(at), at, bound), bound)
