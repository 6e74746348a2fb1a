"""Fig. 25: over the soft bump with the leg angles that vary the torque least."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from stickslip.dynamics.ugv import PoseSolver
from stickslip.envs.rendering import theme
from stickslip.optim import PostureProblem, solve
from stickslip.optim import PostureResult as Solved
from stickslip.optimise.picture import FRONT, REAR
from stickslip.optimise.vehicle import draw_scene, extent, poses
from stickslip.paper import drawing, passage_claims
from stickslip.paper.bump import TRACK, VEHICLE, along_bump
from stickslip.paper.passage_claims import CRITERIA, FREE, HELD, LIMITED, POINTWISE, RATE, Drive
from stickslip.paper.result import Columns, Result, Setting

WAYPOINTS = 66
"""Every 0.1 m."""
BETWEEN = 10
"""Drives are looked at again at so many times as many points, legs turning evenly between."""
FINE, COARSE, HELD_ANGLES = 43, 17, 41
"""Angles of each leg: on the grid with the rate limited; without limit, each move to each pair; of
postures that are held, every 3 degrees."""
VEHICLES = 4
"""Drawn in each sequence."""


def least_variation(setting: Setting) -> Result:
    """Fig. 25."""
    limited, free = along_bump(WAYPOINTS, leg_rate=RATE), along_bump(WAYPOINTS)
    setting.say("legs held")
    held = _best_held(limited)
    setting.say(f"legs turning up to {RATE:g} rad/m")
    grid, refined = _solved(limited, FINE)
    setting.say("legs turning at will")
    grid_free, refined_free = _solved(free, COARSE)
    setting.say("point by point")
    pointwise = solve(free, "grid", polish=False, angles=FINE)
    by_peak = replace(free, criterion="peak_torque")
    bottleneck = solve(by_peak, "grid", polish=False, angles=FINE)
    setting.say("wheels that may overlap")
    _, overlapping = _solved(replace(limited, solver=PoseSolver(overlap=True)), FINE)
    setting.say("between the points")
    found = {
        HELD: held.x,
        LIMITED: refined.x,
        FREE: refined_free.x,
        POINTWISE: pointwise.x,
    }
    drives = {name: _drive(limited, np.asarray(x)) for name, x in found.items()}
    claims = [
        passage_claims.varies_less(drives, held.degrees, HELD_ANGLES),
        passage_claims.between(drives),
        passage_claims.proved(
            {f"{FINE} x {FINE} angles at {RATE:g} rad/m": (grid, refined)}
            | {f"{COARSE} x {COARSE} without limit": (grid_free, refined_free)}
        ),
        passage_claims.wheels(drives[LIMITED], overlapping.value),
        passage_claims.peak(drives, *_bottleneck(bottleneck), held.peak, FINE),
        passage_claims.energy(drives),
        passage_claims.pointwise(drives),
        passage_claims.passes(drives[LIMITED]),
    ]
    tables = {"": _columns(drives), "-between": _between(drives)}
    return Result(tables, lambda: _draw(limited, drives), claims)


def _bottleneck(solved: Solved) -> tuple[float, float]:
    """The largest torque that no posture gets below [N m], and where it is needed [m]."""
    at = along_bump(WAYPOINTS).stations(np.asarray(solved.x))
    return solved.value, float(at.x[int(np.argmax(np.abs(at.torque)))])


class Held(NamedTuple):
    """The best postures held: x and degrees of the one whose torque varies least."""

    x: np.ndarray
    degrees: tuple[float, float]
    peak: passage_claims.Peak
    """The lowest of all."""


def _best_held(problem: PostureProblem) -> Held:
    """The best fixed postures of HELD_ANGLES that the drive can be made with."""
    low, high = (float(np.degrees(end[0])) for end in problem.bounds)
    angles = np.linspace(low, high, HELD_ANGLES).round(9)
    pairs = np.stack(np.meshgrid(angles, angles, indexing="ij"), -1).reshape(-1, 2)
    drives = np.tile(np.radians(pairs), len(problem.x))
    varied, missed = problem.sample(drives)
    peaks = replace(problem, criterion="peak_torque").objectives(drives)
    varied, peaks = (np.where(missed > 0, np.inf, of) for of in (varied, peaks))
    best, low = int(np.argmin(varied)), int(np.argmin(peaks))
    at = [(float(rear), float(front)) for rear, front in pairs[[best, low]]]
    return Held(drives[best], at[0], passage_claims.Peak(float(peaks[low]), at[1]))


def _solved(problem: PostureProblem, angles: int) -> tuple[Solved, Solved]:
    """The best path over the grid, and the local optimum off the grid that it leads to."""
    grid = solve(problem, "dp", polish=False, angles=angles)
    return grid, solve(problem, "scp", start=grid.x)


def _drive(problem: PostureProblem, x: np.ndarray) -> Drive:
    """The drive at the problem's points, and with BETWEEN times as many, legs turning evenly."""
    finer = along_bump((len(problem.x) - 1) * BETWEEN + 1)
    angles = problem.angles(x)
    legs = [np.interp(finer.x, problem.x, angles[:, leg]) for leg in (0, 1)]
    dense = np.stack(legs, -1).reshape(-1)

    def values(problem: PostureProblem, x: np.ndarray) -> dict[str, float]:
        return {name: replace(problem, criterion=name).objective(x) for name in CRITERIA}

    return Drive(
        problem.stations(x), values(problem, x), finer.stations(dense), values(finer, dense)
    )


def _columns(drives: Mapping[str, Drive]) -> Columns:
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


def _between(drives: Mapping[str, Drive]) -> Columns:
    torques = {
        f"{name}: torque [N m]": np.asarray(drive.dense.torque) for name, drive in drives.items()
    }
    return {"front wheel [m]": np.asarray(drives[HELD].dense.x)} | torques


def _draw(problem: PostureProblem, drives: Mapping[str, Drive]):
    shown = np.linspace(0, WAYPOINTS - 1, VEHICLES).round().astype(int)
    placed = {}
    for name in (HELD, LIMITED):
        angles = np.asarray(drives[name].stations.leg_angles)[shown]
        placed[name] = poses(VEHICLE, TRACK, problem.x[shown], angles)
    both = np.array([extent(VEHICLE, of) for of in placed.values()])
    (left, _, bottom, _), (_, right, _, top) = both.min(axis=0), both.max(axis=0)
    scene = 1.15 * 8.3 * (top - bottom) / (right - left)
    ratios = [1.9, 1.9, scene, scene]
    figure, axes = drawing.sheet(
        4, height=(sum(ratios) + 1.6) / 4, sharex=True, height_ratios=ratios
    )
    legs, torque, still, moving = axes[:, 0]
    angles = np.degrees(drives[LIMITED].stations.leg_angles)
    for leg, (label, look) in enumerate((("rear", REAR), ("front", FRONT))):
        legs.plot(problem.x, angles[:, leg], label=label, **look)
        held = float(np.degrees(drives[HELD].stations.leg_angles[0, leg]))
        legs.plot(problem.x, 0 * problem.x + held, color=look["color"], lw=0.8, ls=":")
    legs.yaxis.set_major_locator(drawing.require("matplotlib.ticker").MultipleLocator(30))
    drawing.legend(legs)
    drawing.name_panel(legs, "(a) leg angles [°]", f"{LIMITED}; dotted: best angles held")
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
    drawing.name_panel(
        torque, "torque on each wheel [N m]", "legs turn evenly between points 0.1 m apart"
    )
    for axis, name in ((still, HELD), (moving, LIMITED)):
        draw_scene(axis, VEHICLE, TRACK, placed[name], (left, right))
    drawing.name_panel(still, "(b) the best posture held")
    drawing.name_panel(moving, f"least variation, {LIMITED}", "", "front wheel [m]")
    return figure
