"""Fig. 25: over the soft bump with the leg angles that vary the torque least."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from stickslip.dynamics.status import Status
from stickslip.envs.rendering import theme
from stickslip.optim import PostureProblem, PostureResult, Station, solve
from stickslip.optimise.picture import FRONT, REAR
from stickslip.optimise.vehicle import draw_scene, extent, poses
from stickslip.paper import drawing
from stickslip.paper.bump import TRACK, VEHICLE, along_bump, friction_needed, least_load
from stickslip.paper.figure import (
    NOT_STATED,
    Claim,
    Columns,
    Result,
    by_construction,
    share_of,
    verdict_of,
)

RATE = 1.0
"""Largest leg rate [rad/m]; the chapter has no limit."""
HELD, LIMITED, FREE, POINTWISE = "legs held", f"up to {RATE:g} rad/m", "no limit", "point by point"
WAYPOINTS = 66
"""Every 0.1 m."""
BETWEEN = 10
"""Trajectories are evaluated at so many times as many points, legs turning evenly between."""
FINE, COARSE, HELD_ANGLES = 43, 17, 41
"""Angles of each leg: on the grid with the rate limited; without limit, each move to each pair; of
postures that are held, every 3 degrees."""
VEHICLES = 4
"""Drawn in each sequence."""
VARIATION, PEAK, ENERGY = "torque_variation", "peak_torque", "wheel_energy"


class Drive(NamedTuple):
    """A trajectory of the legs: stations at its points and values there by criterion; dense,
    between: the same with points closer together, the legs turning evenly."""

    stations: Station
    values: Mapping[str, float]
    dense: Station
    between: Mapping[str, float]


Drives = Mapping[str, Drive]


def least_variation(samples: int) -> Result:
    """Fig. 25; its points are WAYPOINTS, whatever samples is."""
    del samples
    limited, free = along_bump(WAYPOINTS, leg_rate=RATE), along_bump(WAYPOINTS)
    held, degrees = best_held(limited)
    grid, refined = _solved(limited, FINE)
    grid_free, refined_free = _solved(free, COARSE)
    pointwise = solve(free, "grid", polish=False, angles=FINE)
    lowest = solve(replace(free, criterion=PEAK), "grid", polish=False, angles=FINE).value
    found = {HELD: held, LIMITED: refined.x, FREE: refined_free.x, POINTWISE: pointwise.x}
    drives = {name: _drive(limited, np.asarray(x)) for name, x in found.items()}
    claims = [
        varies_less(drives, degrees),
        between(drives),
        proved({LIMITED: (grid, refined), FREE: (grid_free, refined_free)}),
        lowest_peak(drives, lowest),
        Claim(
            "angles chosen for each position alone, among all pairs",
            f"{_each(drives, VARIATION, '.0f')} N² m at the points",
            NOT_STATED,
            "a sum over the trajectory is not least where each part of it is",
        ),
        passes(drives[LIMITED]),
    ]
    tables = {"": _columns(drives), "-between": _between(drives)}
    return Result(tables, lambda: _draw(limited.x, drives), claims)


def best_held(problem: PostureProblem) -> tuple[np.ndarray, tuple[float, float]]:
    """The feasible fixed posture of HELD_ANGLES with the least variation; its angles [degrees]."""
    low, high = (float(np.degrees(end[0])) for end in problem.bounds)
    angles = np.linspace(low, high, HELD_ANGLES).round(9)
    pairs = np.stack(np.meshgrid(angles, angles, indexing="ij"), -1).reshape(-1, 2)
    trajectories = np.tile(np.radians(pairs), len(problem.x))
    variation, violation = problem.sample(trajectories)
    best = int(np.argmin(np.where(violation > 0, np.inf, variation)))
    rear, front = pairs[best]
    return trajectories[best], (float(rear), float(front))


def _solved(problem: PostureProblem, angles: int) -> tuple[PostureResult, PostureResult]:
    """The best path over the grid, and the local optimum off the grid that it leads to."""
    grid = solve(problem, "dp", polish=False, angles=angles)
    return grid, solve(problem, "scp", start=grid.x)


def _drive(problem: PostureProblem, x: np.ndarray) -> Drive:
    """The trajectory at the problem's points, and at BETWEEN times as many."""
    finer = along_bump((len(problem.x) - 1) * BETWEEN + 1)
    angles = problem.angles(x)
    dense = np.stack([np.interp(finer.x, problem.x, angles[:, leg]) for leg in (0, 1)], -1).ravel()

    def values(problem: PostureProblem, x: np.ndarray) -> dict[str, float]:
        criteria = (VARIATION, PEAK, ENERGY)
        return {name: replace(problem, criterion=name).objective(x) for name in criteria}

    return Drive(
        problem.stations(x), values(problem, x), finer.stations(dense), values(finer, dense)
    )


def varies_less(drives: Drives, degrees: tuple[float, float]) -> Claim:
    """degrees: of the best posture held."""
    shares = [drives[name].values[VARIATION] / drives[HELD].values[VARIATION] for name in drives]
    below = [1 - share for share in shares[1:3]]
    rear, front = degrees
    return Claim(
        "(read as: leg angles that vary make the torque vary less)",
        f"∫(dM/dx)² dx {_each(drives, VARIATION, '.0f', HELD, LIMITED, FREE)} N² m at the points: "
        f"{' and '.join(f'{100 * of:.0f}' for of in below)} % below the best posture held "
        f"({rear:g}/{front:g}°)",
        by_construction(min(below) >= 0),
        "legs held are one of the trajectories to choose from; the measure, the spacing and the "
        "limit are ours",
    )


def between(drives: Drives) -> Claim:
    """Variation between the points of the planner."""
    held = drives[HELD].between[VARIATION]
    below = [1 - drives[name].between[VARIATION] / held for name in (LIMITED, FREE)]
    shown = [f"{abs(100 * of):.0f} % {'below' if of > 0 else 'above'}" for of in below]
    return Claim(
        "(the same, between the points)",
        f"legs turning evenly between the points: "
        f"{_each(drives, VARIATION, '.0f', HELD, LIMITED, FREE, dense=True)} N² m: "
        f"{' and '.join(shown)} the legs held",
        share_of(of > 0 for of in below),
        "legs without limit swing from one point to the next; partly: one of the two stays below",
    )


def proved(solved: Mapping[str, tuple[PostureResult, PostureResult]]) -> Claim:
    """solved: the best path over a grid, and the local optimum that it leads to."""
    shown = "; ".join(
        f"{name}: {grid.value:.0f} on the grid, {local.value:.0f} off it ({local.status.name})"
        for name, (grid, local) in solved.items()
    )
    return Claim(
        "the minimum variation of torque",
        f"dynamic programming, in N² m: {shown}",
        NOT_STATED,
        "proved for the grid and its points; off the grid local optima",
    )


def lowest_peak(drives: Drives, lowest: float) -> Claim:
    """lowest: the torque that some position needs with every posture [N m]."""
    return Claim(
        "(the largest torque)",
        f"{_each(drives, PEAK, '.2f', HELD, LIMITED, FREE)} N m at the points; no posture lowers "
        f"it below {lowest:.2f} N m; work of the wheels' motors "
        f"{_each(drives, ENERGY, '.0f', HELD, LIMITED, FREE, dense=True)} J",
        NOT_STATED,
        "turning the legs makes the torque a little smoother and hardly smaller",
    )


def passes(drive: Drive) -> Claim:
    """The trajectory holds between its points."""
    at = drive.dense
    return Claim(
        "the sequence shows the UGV passing the bump",
        f"{LIMITED}, between the points, too: |F| / N up to {friction_needed(at):.3f}, normal "
        f"forces {least_load(at):.0f} N or more, {1e3 * np.min(at.clearance):.0f} mm of clearance "
        "or more",
        verdict_of(np.all(np.asarray(at.status) == Status.OK)),
        "the planner checks its points only",
    )


def _each(drives: Drives, name: str, digits: str, *which: str, dense: bool = False) -> str:
    """A value of several trajectories in words."""
    values = {one: of.between if dense else of.values for one, of in drives.items()}
    return ", ".join(f"{values[one][name]:{digits}} ({one})" for one in which or drives)


def _columns(drives: Drives) -> Columns:
    columns: dict[str, Any] = {"front wheel [m]": drives[HELD].stations.x}
    for name, drive in drives.items():
        at = drive.stations
        columns |= {
            f"{name}: rear leg [rad]": at.leg_angles[:, 0],
            f"{name}: front leg [rad]": at.leg_angles[:, 1],
            f"{name}: torque [N m]": at.torque,
            f"{name}: least grip margin [N]": at.grip,
        }
    return columns


def _between(drives: Drives) -> Columns:
    torques = {f"{name}: torque [N m]": drive.dense.torque for name, drive in drives.items()}
    return {"front wheel [m]": drives[HELD].dense.x, **torques}


def _draw(x: np.ndarray, drives: Drives):
    shown = np.linspace(0, len(x) - 1, VEHICLES).round().astype(int)
    placed = poses(VEHICLE, TRACK, x[shown], np.asarray(drives[LIMITED].stations.leg_angles)[shown])
    left, right, bottom, top = extent(VEHICLE, placed)
    ratios = [1.9, 1.9, 1.15 * 8.3 * (top - bottom) / (right - left)]
    height = (sum(ratios) + 1.6) / 3
    figure, axes = drawing.sheet(3, height=height, sharex=True, height_ratios=ratios)
    legs, torque, scene = axes[:, 0]
    angles = np.degrees(drives[LIMITED].stations.leg_angles)
    for leg, (label, look) in enumerate((("rear", REAR), ("front", FRONT))):
        legs.plot(x, angles[:, leg], label=label, **look)
    drawing.legend(legs)
    drawing.name_panel(legs, "(a) leg angles [°]", LIMITED)
    looks = {
        HELD: {"color": theme.MUTED, "ls": ":", "lw": 1.6},
        LIMITED: {"color": theme.INK, "lw": 1.6},
        FREE: {"color": theme.HOLDS, "ls": "--", "lw": 1.2},
        POINTWISE: {"color": theme.HIP_EDGE, "ls": "-.", "lw": 1.2},
    }
    for name, look in looks.items():
        torque.plot(drives[name].dense.x, drives[name].dense.torque, label=name, **look)
    drawing.mark(torque, y=0.0)
    drawing.legend(torque)
    note = "legs turn evenly between points 0.1 m apart"
    drawing.name_panel(torque, "torque on each wheel [N m]", note)
    draw_scene(scene, VEHICLE, TRACK, placed, (left, right))
    drawing.name_panel(scene, f"(b) least variation, {LIMITED}", "", "front wheel [m]")
    return figure
