"""A bound for every drive: cells of leg angles, halved where a better drive may still pass."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.checks import require_integer, require_kind, require_memory
from stickslip.optim.posture.bounds.cells import NONE, StationCells, Surveyor, first_axis, shapes
from stickslip.optim.posture.bounds.ground import ground_of
from stickslip.optim.posture.bounds.sweep import Sums, bottleneck, place
from stickslip.optim.posture.criteria import LEAST_NORMAL
from stickslip.optim.posture.evaluate import PostureResult, below, tolerated
from stickslip.optim.posture.grid import solve_dp
from stickslip.optim.posture.problem import PostureProblem
from stickslip.optim.problem import COUNT, FEASIBLE, OptimStatus, require_scalar
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Float, Int


NAMES = ("peak_torque", "grip", "normal_force", "friction_demand")


def at_least(name: str, of: StationCells) -> np.ndarray:
    """Lower bound of a station's cost in each cell."""
    if name == "peak_torque":
        found = np.maximum(of.at_least("torque", 1), of.at_least("torque", -1))
    elif name == "normal_force":
        found = np.maximum(of.at_least("N_rear", -1), of.at_least("N_front", -1))
    elif name == "grip":
        each = [of.grip_at_most(wheel, sign) for wheel in (0, 1) for sign in (1, -1)]
        found = -np.min(each, axis=0)
    else:
        each = [
            of.range_of(F).least_size / np.maximum(-of.at_least(N, -1), LEAST_NORMAL)
            for F, N in of.wheels
        ]
        found = np.max(each, axis=0) * (1 - 1e-12)
    floor = 0.0 if name in ("peak_torque", "friction_demand") else -np.inf
    found = np.where(np.isnan(found), floor, np.maximum(found, floor))
    return np.where(of.alive, found, np.inf)


def carried(
    costs: np.ndarray, legs: tuple[Int[np.ndarray, "n m"], Int[np.ndarray, "n m"]]
) -> np.ndarray:
    """Least value, for each cell of the neighbouring waypoint, of those that a move may lead to or
    from; legs: of each leg, by the cells of that waypoint and of this one, see shapes."""
    for axis, shape in enumerate(legs):
        some = np.expand_dims(shape != NONE, 2 - axis)
        best = [np.min(costs, axis, initial=np.inf, where=row) for row in some]
        costs = np.stack(best, axis)
    return costs


class Worst:
    """The bound of a worst station at one level after the other: of all paths of cells that the
    rate may allow the one whose worst cell is least."""

    fields = ("torque", "F", "F_front", "N_rear", "N_front")

    def __init__(self, problem: PostureProblem, x: np.ndarray | None):
        self.problem, self.x = problem, x
        name = problem.criterion.name
        if name not in NAMES:
            raise ValueError(f"criterion = {name}; accepted: {', '.join(NAMES)}, and sums")

    def bound(
        self, cells: list[StationCells], least: float, enough: float, tick: Callable[[], None]
    ) -> tuple[float, list[StationCells], np.ndarray]:
        name = self.problem.criterion.name
        costs = [at_least(name, of) for of in cells]
        legs = [
            (shapes(self.problem, k, a.rear, b.rear), shapes(self.problem, k, a.front, b.front))
            for k, (a, b) in enumerate(pairwise(cells))
        ]
        arrived, to_go = [costs[0]], [costs[-1]]
        for k, cost in enumerate(costs[1:]):
            arrived.append(np.maximum(cost, carried(arrived[-1], (legs[k][0].T, legs[k][1].T))))
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


CELLS = 42
"""Cells of each leg's range at the first level, about."""
CORNERS = 600_000
"""Most corners of all waypoints together, at the finest level."""
BEYOND = 1e-3
"""Share by which the least torque of all drives is above a limit that none meets."""
MOST_LEVELS = 8
FIRST = 2_500
"""Bytes of a cell that is not yet halved, with its derivatives."""
JOINTS = 100.0
"""A bound is lowered by this many times what a table's joints miss by rounding, in parts of it."""


@dataclass(frozen=True)
class DriveBound:
    """Lower bound on every drive at a problem's waypoints.

    value: the bound, in the criterion's unit. It holds for every drive, whatever its leg angles,
    that the problem calls feasible at its waypoints; best: the value of the best drive known, or
    infinite. levels: how the bound grew: of each level of cells their width at the rear leg [rad],
    the bound, and the share of them alive, which a better drive may pass. seconds: all of it.

    Proved in interval arithmetic, with the one assumption of `stickslip.optim.intervals` and, on
    tables whose pieces miss each other by rounding, an allowance of JOINTS times that. Left out, so
    that it may be lower than need be: clearance, the motors' torque, and ground that enters a wheel
    beside its contact. No bound for what lies between the waypoints."""

    value: float
    best: float
    levels: tuple[dict[str, float], ...]
    seconds: float

    @property
    def gap(self) -> float:
        """Gap between the best known drive and the bound: (best - bound) / best."""
        if not np.isfinite(self.best):
            return np.inf
        difference = self.best - self.value
        return difference / abs(self.best) if difference > 0 else 0.0


def bound_every_drive(
    problem: PostureProblem,
    x: Float[np.ndarray, "n"] | None = None,
    *,
    tolerance: float = 0.02,
    cells: int = CELLS,
    most_corners: int = CORNERS,
    progress: bool = False,
) -> DriveBound:
    """Lower bound on the value of every drive at the problem's waypoints, on the grid or off it.

    Leg angles are cut into cells at every waypoint. Torques, turns and forces at corners and their
    derivatives inside are enclosed in intervals (ground.py, vehicle.py); with them dynamic
    programming over pairs of cells bounds every drive (steps.py, sweep.py). Cells that no drive as
    good as the best known can pass are dropped, the others halved where the bound loses, until the
    gap is `tolerance`, the next level has more than `most_corners`, or there were MOST_LEVELS.

    x: the best drive known, feasible; by default none: nothing is dropped. cells: of each leg's
    range at the first, about. ValueError, before anything is computed, for ground given as a
    function, of which no enclosure is known (see Track.resampled), and for own criteria.

    It is a bound of exact poses, however the problem's solver finds its own: with a coarse
    tolerance a drive may seem to cost less by what that misses.
    """
    began = time.perf_counter()
    require_kind("problem", problem, PostureProblem, "a PostureProblem")
    require_scalar("tolerance", tolerance, low=0.0, accepted="a number >= 0")
    require_integer("cells", cells, low=2, high=COUNT)
    require_integer("most_corners", most_corners, high=COUNT)
    require_boundable(problem)
    best = problem.objective(x) if x is not None and problem.is_feasible(x) else np.inf
    K = len(problem.x)
    require_memory(f"cells = {cells} at {K} waypoints", "cells", K * float(cells) ** 2, FIRST)
    method = _method(problem, x if np.isfinite(best) else None)
    surveyor = Surveyor(problem, method.fields)
    enough = best - tolerance * abs(best) if np.isfinite(best) else -np.inf
    found, levels, after, note = -np.inf, [], [], "no bound yet"
    worth = np.ones(K, bool)
    while True:
        # A waypoint is surveyed, and its costs to go and of arriving bounded: three turns for each.
        with Bar(f"branch, level {len(levels) + 1}", 3 * K, "turn", progress) as bar:
            bar.advance(0, note)
            now = [_cells_at(surveyor, k, cells, after, worth, bar) for k in range(K)]
            bound, after, worth = method.bound(now, best, enough, bar.advance)
        found = max(found, _settled(problem, bound, best, surveyor.ground.missed))
        alive = float(np.mean([np.mean(of.alive) for of in after]))
        widths = [float(np.max(np.diff(of.rear))) for of in now]
        levels.append({"cells": min(widths[1:-1] or widths), "bound": found, "alive": alive})
        boxed = [of.alive[of.box].size for of in after]
        size = float(sum(n * (4 if halve else 1) for n, halve in zip(boxed, worth, strict=True)))
        if found >= enough or alive == 0 or size > most_corners or len(levels) == MOST_LEVELS:
            break
        note = f"at least {found:.6g}"
    return DriveBound(found, float(best), tuple(levels), time.perf_counter() - began)


def require_boundable(problem: PostureProblem) -> None:
    """ValueError for ground or a criterion that `bound_every_drive` does not cover."""
    ground_of(problem.track.shape)
    _method(problem, None)


def _method(problem: PostureProblem, known: Float[np.ndarray, "n"] | None) -> Worst | Sums:
    if problem.free_split:
        raise ValueError("free_split = True; accepted: False, for bounds of every drive")
    return (Worst if problem.criterion.kind == "max" else Sums)(problem, known)


def _cells_at(
    surveyor: Surveyor, k: int, cells: int, before: list[StationCells], worth: np.ndarray, bar: Bar
) -> StationCells:
    """The cells of waypoint k: `cells` of a leg's range, or those before, halved where worth it."""
    bar.advance()
    if before:
        return surveyor.halved(k, before[k]) if worth[k] else before[k]
    problem = surveyor.problem
    if (pair := problem.given_at(k)) is None:
        return surveyor.first(k, *(first_axis(problem, leg, cells) for leg in (0, 1)))
    near = np.array([-FEASIBLE, FEASIBLE])  # the tolerance of a feasible drive
    return surveyor.first(k, *(near + of for of in pair))


def _settled(problem: PostureProblem, bound: float, best: float, missed: float) -> float:
    """The bound of all drives: those of the dropped cells cost more than the best one known."""
    bound = min(bound, best)
    if not np.isfinite(bound):
        return bound
    lowered = below(problem, bound - JOINTS * missed * abs(bound))
    recovers = bool(problem.params.regeneration_efficiency)
    if recovers or problem.criterion.name in ("grip", "normal_force"):
        return lowered
    return max(lowered, 0.0)  # the others are nowhere below


def solve_branch(
    problem: PostureProblem,
    *,
    progress: bool = False,
    tolerance: float = 0.02,
    cells: int = CELLS,
    most_corners: int = CORNERS,
    start: Float[np.ndarray, "n"] | None = None,
) -> PostureResult:
    """The best drive known, and a bound for every drive: on a grid of leg angles or off it.

    start: the drive [2K]; None: that of dp, polished by scp. The lower bound is that of
    `bound_every_drive`, whose options tolerance, cells and most_corners are. OPTIMAL where the gap
    is within the tolerance, else FEASIBLE; INFEASIBLE where it proves that there is no drive.
    details: gap (of the value), levels (see DriveBound). evaluations: of the drive's own method.
    """
    began = time.perf_counter()
    require_boundable(problem)
    if start is None:
        drive = solve_dp(problem, progress=progress, polish=True)
    else:
        x = problem.start_point(start, progress)[0]
        given = {"method": "branch", "status": OptimStatus.FEASIBLE, "evaluations": 1}
        drive = problem.result(x, began=began, **given)
    options: dict[str, Any] = {"cells": cells, "most_corners": most_corners, "progress": progress}
    known = drive.x if drive.feasible else None
    found = bound_every_drive(problem, known, tolerance=tolerance, **options)
    details = {"gap": found.gap, "levels": list(found.levels)}
    torque, most = problem.criterion.name == "peak_torque", float(problem.max_torque or np.inf)
    beyond = torque and found.value > (1 + BEYOND) * most + tolerated(problem, "torque")
    if found.value == float("inf") or (beyond and not drive.feasible):
        return PostureResult.without_point(
            method="branch",
            status=OptimStatus.INFEASIBLE,
            began=began,
            message=f"no drive meets the constraints, on a grid or off; {drive.message}",
            evaluations=drive.evaluations,
            details={**drive.details, **details},
        )
    status, message = drive.status, f"no drive found: {drive.message}"
    if drive.feasible:
        status = OptimStatus.OPTIMAL if found.gap <= tolerance else OptimStatus.FEASIBLE
        message = f"within {found.gap:.2%} of the best that any drive can do"
    return replace(
        drive,
        method="branch",
        status=status,
        lower_bound=min(found.value, drive.value) if found.value > -np.inf else None,
        seconds=time.perf_counter() - began,
        message=message,
        details=details,
    )
