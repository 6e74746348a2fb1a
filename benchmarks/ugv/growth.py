"""Dynamic programming: its time against the grid and the track, its value against the grid."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.ugv.tracks import twelve
from stickslip.dynamics.ugv import UGVParams
from stickslip.optim import PostureProblem, PostureResult, solve
from stickslip.optim.posture.graph.dp import best_paths
from stickslip.optim.posture.graph.posture_grid import build_grid, offsets

ANGLES = (22, 43, 64)
"""Of each leg: 21 k + 1, so that the rate lets it move by k of them, to 0.3 % all that it allows.
Other numbers round the reach down, and a finer grid may then hold worse paths than a coarse one."""
LENGTHS = (29, 59, 118, 236)
WAYPOINTS, MIDDLING = 118, 22
"""Waypoints where the grid varies; angles where the track does."""
RATE, FIRST, LAST = 2.0, 2.0, 7.85
"""[rad/m]; the front wheel's first and last place [m]: 0.05 m and 0.1 rad from one to the next."""
FINER = 10
"""Pieces of each step on which a drive's value is looked up again."""
REPEATS = 3
ON_GRIDS = ("rough E", "bump 0")
"""Tracks on which dp's value is set against the grid's."""
REFERENCE = 43
"""Angles of the grid from whose path `scp` looks for the optimum off the grid."""


def problem_on(name: str, criterion: str = "wheel_energy", waypoints: int = WAYPOINTS):
    """The posture problem on one of the twelve tracks, steps of 0.05 m whatever their number.

    Beyond the track the table goes on straight: only times are taken there.
    """
    track = {one.name: one for one in twelve()}[name].track()
    step = (LAST - FIRST) / (WAYPOINTS - 1)
    x = FIRST + step * np.arange(waypoints)
    return PostureProblem(UGVParams(), track, x, criterion, leg_rate=RATE)


def finer_value(problem: PostureProblem, found: PostureResult) -> float | None:
    """The value of a drive on a spacing FINER times as fine, the legs turning evenly from one
    waypoint to the next: what the problem's own waypoints leave out shows. None for no number."""
    if found.leg_angles is None:
        return None
    own = np.arange(len(problem.x))
    at = np.linspace(0, own[-1], own[-1] * FINER + 1)
    x, rear, front = (np.interp(at, own, of) for of in (problem.x, *found.leg_angles.T))
    value = replace(problem, x=x).objective(np.stack([rear, front], 1).ravel())
    return value if np.isfinite(value) else None


def growth(quick: bool) -> Iterator[dict[str, Any]]:
    """Seconds of the stations and of the recursion, warm; one row for each size."""
    angles, lengths = (ANGLES[:2], LENGTHS[:2]) if quick else (ANGLES, LENGTHS)
    sizes = [("angles", n, WAYPOINTS) for n in angles]
    sizes += [("waypoints", MIDDLING, K) for K in lengths]
    known: dict[tuple[int, int], dict[str, Any]] = {}
    for varied, n, K in sizes:
        if (n, K) not in known:
            known[n, K] = _times(n, K)
        yield {"varied": varied, "angles": n, "waypoints": K, **known[n, K]}


def _times(angles: int, waypoints: int) -> dict[str, Any]:
    problem = problem_on(ON_GRIDS[0], waypoints=waypoints)

    def build():
        return build_grid(problem, angles, method="dp", progress=False)

    begun = time.process_time()
    grid = build()
    first = time.process_time() - begun
    begun = time.process_time()
    paths = best_paths(grid)
    first += time.process_time() - begun
    return {
        "moves": len(list(offsets(grid))),
        "stations": _seconds(build),
        "recursion": _seconds(lambda: best_paths(grid)),
        "first": first,
        "value": float(np.min(paths.values[-1])),
    }


def _seconds(run: Callable[[], Any]) -> float:
    """Least processor seconds of a few runs, all of which give NumPy arrays."""
    taken = []
    for _ in range(REPEATS):
        begun = time.process_time()
        run()
        taken.append(time.process_time() - begun)
    return min(taken)


def grids(quick: bool) -> Iterator[dict[str, Any]]:
    """dp's value and seconds with each grid beside the best one off the grid.

    excess: over the value with the legs straight down, as the best one may be zero.
    """
    for criterion in ("wheel_energy", "peak_torque"):
        for name in ON_GRIDS[:1] if quick else ON_GRIDS:
            problem = problem_on(name, criterion)
            straight = problem.objective(np.full(problem.n, np.pi / 2))
            best = solve(problem, "scp", angles=MIDDLING if quick else REFERENCE)
            for n in ANGLES[:2] if quick else ANGLES:
                solve(problem, "dp", polish=False, angles=n)
                found = solve(problem, "dp", polish=False, angles=n)
                yield {
                    "track": name,
                    "criterion": criterion,
                    "angles": n,
                    "value": found.value,
                    "seconds": found.seconds,
                    "finer": finer_value(problem, found),
                    "off_grid": best.value,
                    "off_grid_finer": finer_value(problem, best),
                    "straight": straight,
                    "off_grid_feasible": best.feasible,
                    "excess": (found.value - best.value) / straight,
                }


def exponent(sizes: list[float], seconds: list[float]) -> float:
    """Slope of log seconds in log size, by least squares over the upper half of the sizes."""
    upper = slice(-max(2, (len(sizes) + 1) // 2), None)
    return float(np.polyfit(np.log(sizes[upper]), np.log(seconds[upper]), 1)[0])
