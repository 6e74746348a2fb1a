"""Bounds for worst stations: what no posture of a cell goes below, and the least worst path."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import minimum_filter

from stickslip.optim.posture.bounds.lattice import moves
from stickslip.optim.posture.bounds.station_cells import of_corners
from stickslip.optim.posture.criteria import LEAST_NORMAL

if TYPE_CHECKING:
    from stickslip.optim.posture.bounds.station_cells import StationCells
    from stickslip.optim.posture.problem import PostureProblem

NAMES = ("peak_torque", "grip", "normal_force", "friction_demand")


def at_least(name: str, of: StationCells, mu: float) -> np.ndarray:
    """The criterion's cost of a station, a number it is not below in each cell."""
    if name == "peak_torque":
        found = np.maximum(of.at_least("torque", 1), of.at_least("torque", -1))
        found = np.maximum(found, 0.0)
    elif name == "normal_force":
        found = np.maximum(of.at_least("N_rear", -1), of.at_least("N_front", -1))
    elif name == "grip":
        found = np.max(
            [_missing(of, wheel, sign, mu) for wheel in ("N_rear", "N_front") for sign in (1, -1)],
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


def carried(costs: np.ndarray, reach: tuple[int, int] | None, shape: tuple[int, ...]) -> np.ndarray:
    """The least of the cells within reach, for each cell of the neighbouring waypoint."""
    if reach is None or costs.shape != shape:
        return np.full(shape, np.min(costs))
    return minimum_filter(costs, tuple(2 * n + 1 for n in reach), mode="constant", cval=np.inf)


class Worst:
    """The bound of a worst station at one level after the other: of all paths of cells that the
    rate may allow the one whose worst cell is least."""

    fields = ("torque", "F", "N_rear", "N_front")

    def __init__(self, problem: PostureProblem):
        self.problem = problem
        self.friction = np.broadcast_to(np.asarray(problem.friction, float), problem.x.shape)
        name = problem.criterion.name
        if name not in NAMES:
            raise ValueError(f"criterion = {name}; accepted: {', '.join(NAMES)}, and sums")

    def bound(
        self, cells: list[StationCells], least: float, enough: float, tick: Callable[[], None]
    ) -> tuple[float, list[StationCells]]:
        """As Sums.bound."""
        name = self.problem.criterion.name
        costs = [at_least(name, of, float(self.friction[k])) for k, of in enumerate(cells)]
        reaches = [self._reach(k, a, b) for k, (a, b) in enumerate(pairwise(cells))]
        arrived, to_go = [costs[0]], [costs[-1]]
        for k, cost in enumerate(costs[1:]):
            arrived.append(np.maximum(cost, carried(arrived[-1], reaches[k], cost.shape)))
            tick()
        for k in range(len(costs) - 2, -1, -1):
            to_go.append(np.maximum(costs[k], carried(to_go[-1], reaches[k], costs[k].shape)))
            tick()
        passed = [
            replace(of, alive=of.alive & (np.maximum(a, b) <= least))
            for of, a, b in zip(cells, arrived, to_go[::-1], strict=True)
        ]
        return float(np.min(arrived[-1])), passed

    def _reach(self, k: int, a: StationCells, b: StationCells) -> tuple[int, int] | None:
        """How many cells each leg may go in step k; None: any."""
        if self.problem.leg_rate is None:
            return None
        found = []
        for before, after in ((a.rear, b.rear), (a.front, b.front)):
            corners = moves(self.problem, k, before, after)
            rows, columns = np.nonzero(corners)
            found.append(int(np.max(np.abs(rows - columns), initial=0)))
        return found[0], found[1]
