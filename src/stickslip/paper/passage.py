"""Fig. 25: over the soft bump with the leg angles that vary the torque least."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.optim import PostureProblem, Station, solve
from stickslip.optim import Result as Solved
from stickslip.optimise.picture import FRONT, REAR
from stickslip.optimise.vehicle import draw_scene, extent, poses
from stickslip.paper import drawing
from stickslip.paper.bump import FRICTION, LEAST, MOST, TRACK, VEHICLE, along_bump
from stickslip.paper.result import NOT_STATED, Claim, Columns, Result, Setting, verdict_of

WAYPOINTS = 66
"""Every 0.1 m."""
RATE = 1.0
"""What the legs may turn for each metre of the front wheel [rad/m]; the chapter has no limit."""
FINE, COARSE = 33, 17
"""Angles of each leg on the grid: with the rate limited; without limit, each move to each pair."""
HELD, LIMITED, FREE, POINTWISE = "legs held", f"up to {RATE:g} rad/m", "no limit", "point by point"
VEHICLES = 4
"""Drawn in each sequence."""
NUMBERS = {
    "torque_variation": "variation of torque",
    "peak_torque": "largest torque",
    "wheel_energy": "motors' work",
    "total_energy": "motors' and legs' work",
    "friction_demand": "largest |F| / N",
}


class Drive(NamedTuple):
    """A drive, its stations and its values by the criteria of NUMBERS."""

    x: np.ndarray
    stations: Station
    values: Mapping[str, float]


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
    found = {
        HELD: held.x,
        LIMITED: refined.x,
        FREE: refined_free.x,
        POINTWISE: pointwise.x,
    }
    drives = {name: _drive(limited, np.asarray(x)) for name, x in found.items()}
    claims = [
        _varies_less(drives, held.degrees),
        _proved(grid, refined, grid_free, refined_free),
        _peak(drives, bottleneck, held),
        _energy(drives),
        _pointwise(drives),
        _passes(drives),
    ]
    return Result({"": _columns(drives)}, lambda: _draw(limited, drives), claims)


class Held(NamedTuple):
    """The best postures held: x and degrees of the one whose torque varies least."""

    x: np.ndarray
    degrees: tuple[float, float]
    peak: tuple[float, tuple[float, float]]
    """The lowest largest torque [N m], and the angles that have it [degrees]."""


def _best_held(problem: PostureProblem) -> Held:
    """The best fixed postures of the fine grid."""
    angles = np.linspace(LEAST, MOST, FINE)
    pairs = np.stack(np.meshgrid(angles, angles, indexing="ij"), -1).reshape(-1, 2)
    drives = np.tile(np.radians(pairs), len(problem.x))
    peaks = replace(problem, criterion="peak_torque").objectives(drives)
    best, low = int(np.argmin(problem.objectives(drives))), int(np.argmin(peaks))
    at = [(float(rear), float(front)) for rear, front in pairs[[best, low]]]
    return Held(drives[best], at[0], (float(peaks[low]), at[1]))


def _solved(problem: PostureProblem, angles: int) -> tuple[Solved, Solved]:
    """The best path over the grid, and the local optimum off the grid that it leads to."""
    grid = solve(problem, "dp", polish=False, angles=angles)
    return grid, solve(problem, "scp", start=grid.x)


def _drive(problem: PostureProblem, x: np.ndarray) -> Drive:
    values = {name: replace(problem, criterion=name).objective(x) for name in NUMBERS}
    return Drive(x, problem.stations(x), values)


def _each(drives: Mapping[str, Drive], name: str, digits: str, *which: str) -> str:
    """A value of several drives in words."""
    return ", ".join(f"{drives[one].values[name]:{digits}} ({one})" for one in which or drives)


def _less(drives: Mapping[str, Drive], name: str, which: str) -> float:
    """By what share a value is below that of the legs held [-]."""
    return 1 - drives[which].values[name] / drives[HELD].values[name]


def _varies_less(drives: Mapping[str, Drive], pair: tuple[float, float]) -> Claim:
    shares = [_less(drives, "torque_variation", which) for which in (LIMITED, FREE)]
    return Claim(
        "(read as: leg angles that vary make the torque vary less)",
        f"∫(dM/dx)² dx {_each(drives, 'torque_variation', '.0f', HELD, LIMITED, FREE)} N² m: "
        f"{100 * shares[0]:.0f} and {100 * shares[1]:.0f} % below the best posture held "
        f"({pair[0]:g}/{pair[1]:g}° of {FINE} x {FINE})",
        verdict_of(min(shares) > 0.01),
        "the chapter prints curves alone, neither its measure of variation nor how fast the legs "
        "turn; the measure and the limit are ours",
    )


def _proved(grid: Solved, refined: Solved, grid_free: Solved, refined_free: Solved) -> Claim:
    return Claim(
        "the minimum variation of torque",
        f"dynamic programming: {grid.value:.0f} N² m is the least of all paths over "
        f"{FINE} x {FINE} angles at {RATE:g} rad/m, {grid_free.value:.0f} over {COARSE} x {COARSE} "
        f"without limit; from there off the grid {refined.value:.0f} and {refined_free.value:.0f}",
        NOT_STATED,
        "the first are proved for the grid (every path is looked at), the last are local optima: "
        f"scp ends {refined.status.name} and {refined_free.status.name}",
    )


def _peak(drives: Mapping[str, Drive], bottleneck: Solved, held: Held) -> Claim:
    at = np.asarray(drives[HELD].stations.x)
    where = at[
        int(np.argmax(np.abs(along_bump(WAYPOINTS).stations(np.asarray(bottleneck.x)).torque)))
    ]
    return Claim(
        "(the largest torque)",
        f"{_each(drives, 'peak_torque', '.2f', HELD, LIMITED, FREE)} N m; "
        f"the lowest with the legs held {held.peak[0]:.2f} N m at "
        f"{held.peak[1][0]:g}/{held.peak[1][1]:g}°",
        NOT_STATED,
        f"with the front wheel at {where:.1f} m no posture of {FINE} x {FINE} needs less than "
        f"{bottleneck.value:.2f} N m, so turning the legs hardly lowers the peak",
    )


def _energy(drives: Mapping[str, Drive]) -> Claim:
    return Claim(
        "(what it costs)",
        "work of the wheels' motors "
        f"{_each(drives, 'wheel_energy', '.0f', HELD, LIMITED, FREE)} J; with the legs' actuators "
        f"{_each(drives, 'total_energy', '.0f', HELD, LIMITED, FREE)} J",
        NOT_STATED,
        "the chapter counts the wheels alone. Legs that turn under load work too; none is "
        "recovered here. Where the legs begin and end is free",
    )


def _pointwise(drives: Mapping[str, Drive]) -> Claim:
    name = "torque_variation"
    step = np.max(np.abs(np.diff(drives[POINTWISE].stations.leg_angles, axis=0)))
    return Claim(
        "angles chosen for each position alone, among all pairs",
        f"{_each(drives, name, '.0f', POINTWISE, FREE, HELD)} N² m; the legs jump up to "
        f"{np.degrees(step):.0f}° in 0.1 m",
        NOT_STATED,
        "each place takes the torque nearest to the last one's. A sum over the drive is not least "
        "where each part of it is"
        + (
            "; here even holding the legs is better"
            if drives[POINTWISE].values[name] > drives[HELD].values[name]
            else ""
        ),
    )


def _passes(drives: Mapping[str, Drive]) -> Claim:
    of = drives[LIMITED]
    least = min(float(np.min(N)) for N in (of.stations.N_rear, of.stations.N_front))
    return Claim(
        "the sequence shows the UGV passing the bump",
        f"{LIMITED}: |F| / N up to {of.values['friction_demand']:.3f} (μ = {FRICTION:g} taken), "
        f"normal forces {least:.0f} N or more, {1e3 * np.min(of.stations.clearance):.0f} mm of "
        "clearance or more",
        verdict_of(np.all(np.asarray(of.stations.status) == 0)),
        "every waypoint has a place, a grip and a load on both wheels",
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


def _draw(problem: PostureProblem, drives: Mapping[str, Drive]):
    shown = np.linspace(0, WAYPOINTS - 1, VEHICLES).round().astype(int)
    placed = {}
    for name in (HELD, LIMITED):
        angles = problem.angles(drives[name].x)[shown]
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
        torque.plot(problem.x, drives[name].stations.torque, label=name, **look)
    drawing.mark(torque, y=0.0)
    drawing.legend(torque)
    drawing.name_panel(torque, "torque on each wheel [N m]", "negative: drives forwards")
    for axis, name in ((still, HELD), (moving, LIMITED)):
        draw_scene(axis, VEHICLE, TRACK, placed[name], (left, right))
    drawing.name_panel(still, "(b) the best posture held")
    drawing.name_panel(moving, f"least variation, {LIMITED}", "", "front wheel [m]")
    return figure
