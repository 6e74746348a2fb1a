"""What a vehicle can pass, for `stickslip robot`: slopes and steps, and the friction they need."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.biped.settings import precision
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import Track, UGVParams, equilibrium, pose
from stickslip.dynamics.ugv.vehicle_file import UNITS, VEHICLE
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require
from stickslip.envs.rendering.sheet import make_sheet, name_panel
from stickslip.optim import PostureProblem, solve
from stickslip.optim.progress import say_stage
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SLOPES = np.linspace(0.0, 1.0, 21)
HEIGHTS = (0.05, 0.1, 0.15, 0.2)
"""Heights of steps of the default length, 0.5 m [m]."""
ANGLES = 31
"""Angles of each leg that are tried on a slope."""
AMPLE = 10.0
"""Friction at which no wheel slips, to ask for the least [-]."""
HEAD = """# One side of a vehicle for stickslip. Every line is optional.
# Numbers are in SI units, or texts with their units: 0.83 or "830 mm".
# `stickslip robot FILE` checks the file.
machine = "ugv"

[vehicle]
"""
TAIL = """
# [motor]
# torque_limit = "400 N m"  # of each wheel
"""


def vehicle_template() -> str:
    """A file of the default vehicle."""
    rows = []
    for name, value in vars(UGVParams()).items():
        unit = UNITS[name]
        text = f'"{np.degrees(value):.6g} deg"' if unit == "rad" else f"{value}  # [{unit}]"
        rows.append(f"{name} = {text}\n")
    return "".join([HEAD, *rows, TAIL])


def vehicle_page(
    path: Path, changes: Mapping[str, str], frictions: Sequence[float]
) -> tuple[dict[str, str], dict[str, Table], Figure]:
    """Facts in words, tables and the picture of a vehicle."""
    vehicle = UGVParams.from_file(path, changes)
    limit = VEHICLE.read(path, changes).get("motor.torque_limit")
    slopes = np.array([slope_friction(vehicle, float(one), limit) for one in SLOPES])
    climbs = [[mu, steepest(slopes, mu)] for mu in frictions]
    steps = []
    for height in HEIGHTS:
        say_stage(f"step of {100 * height:g} cm")
        steps.append([height, step_friction(vehicle, height, limit)])
    tables = {
        "slopes": Table((Column("friction"), Column("steepest_slope")), climbs),
        "steps": Table((Column("step", "m"), Column("least_friction")), steps),
    }
    low, high = (np.degrees(float(one)) for one in (vehicle.leg_angle_min, vehicle.leg_angle_max))
    facts = {
        "total mass, one side": f"{float(vehicle.weight / vehicle.gravity):.4g} kg",
        "leg angles": f"{low:.4g} to {high:.4g} degrees",
        "motor": "no limit" if limit is None else f"{limit:g} N m at each wheel",
    }
    passed = [height for height, mu in steps if mu is not None]
    tried = f"{passed[-1]:g} m" if passed else "none"
    facts["highest of the steps tried"] = f"{tried}, smoothed over 0.5 m"
    return facts, tables, draw(vehicle, slopes, steps)


def slope_friction(vehicle: UGVParams, slope: float, limit: float | None) -> float:
    """The least friction that holds the vehicle on a slope in its best posture; inf where no
    posture stands, or the motors are too weak."""
    legs = np.linspace(float(vehicle.leg_angle_min), float(vehicle.leg_angle_max), ANGLES)
    angles = np.stack(np.meshgrid(legs, legs, indexing="ij"), -1).reshape(-1, 2)
    with precision("float64"):
        found = equilibrium(vehicle, Track.incline(slope), 4.0, angles, AMPLE)
    stands = np.asarray(found.status) == Status.OK
    ratios = [
        np.abs(np.asarray(force)) / np.where(np.asarray(normal) > 0, normal, np.nan)
        for force, normal in ((found.F_rear, found.N_rear), (found.F_front, found.N_front))
    ]
    needed = np.where(stands, np.maximum(*ratios), np.nan)
    if limit is not None:
        needed = np.where(np.abs(np.asarray(found.torque)) <= limit, needed, np.nan)
    return float(np.nanmin(needed)) if np.isfinite(needed).any() else float("inf")


def steepest(needed: np.ndarray, mu: float) -> float | None:
    """The steepest slope up to which a friction is enough, between the slopes tried linearly."""
    enough = needed <= mu
    if not enough[0]:
        return None
    last = len(needed) if enough.all() else int(np.argmin(enough))
    if last == len(needed) or not np.isfinite(needed[last]):
        return float(SLOPES[last - 1])
    return float(np.interp(mu, needed[last - 1 : last + 1], SLOPES[last - 1 : last + 1]))


def step_friction(vehicle: UGVParams, height: float, limit: float | None) -> float | None:
    """The least friction of a drive over a smoothed step, by dynamic programming over leg angles;
    None where no drive passes."""
    track = Track.step(height)
    given: dict[str, Any] = {"friction": AMPLE, "max_torque": limit}
    problem = PostureProblem.along(track, "friction_demand", vehicle, 0.05, **given)
    found = solve(problem, "dp", polish=False)
    return None if found.x is None else float(found.value)


def draw(vehicle: UGVParams, slopes: np.ndarray, steps: list[list[Any]]) -> Figure:
    """The vehicle in four postures over the friction that slopes and steps need."""
    figure, axes = make_sheet(2, 4, (11, 6), heights=(2, 3), sharex=False)
    low, high = float(vehicle.leg_angle_min), float(vehicle.leg_angle_max)
    middle = (low + high) / 2
    for axis, pair in zip(
        axes[:4], ((middle, middle), (high, high), (middle, high), (high, middle)), strict=True
    ):
        _draw_posture(axis, vehicle, pair)
        name_panel(axis, f"legs at {np.degrees(pair[0]):.0f}° and {np.degrees(pair[1]):.0f}°")
    same_scale(axes[:4])
    for axis in axes[5:7]:
        axis.set_visible(False)
    left, right = axes[4], axes[7]
    grid: Any = left.get_gridspec()
    left.set_subplotspec(grid[1, :2])
    right.set_subplotspec(grid[1, 2:])
    left.plot(SLOPES, slopes, color=theme.PLAYERS[0])
    name_panel(left, "least friction [-]", "", "slope [-]")
    passed = [(height, mu) for height, mu in steps if mu is not None]
    if passed:
        right.plot(*zip(*passed, strict=True), "o-", color=theme.PLAYERS[1])
    name_panel(right, "least friction [-]", "", "height of a step [m]")
    return figure


def same_scale(axes: Sequence[Axes]) -> None:
    """Give pictures of a machine the same limits."""
    for name in ("xlim", "ylim"):
        ends = np.array([getattr(axis, f"get_{name}")() for axis in axes])
        for axis in axes:
            getattr(axis, f"set_{name}")(ends[:, 0].min(), ends[:, 1].max())


def _draw_posture(axis: Axes, vehicle: UGVParams, angles: tuple[float, float]) -> None:
    patches = require("matplotlib.patches")
    with precision("float64"):
        at = pose(vehicle, Track.flat(), 4.0, np.array(angles))
    hinges = []
    for wheel, hinge in ((at.rear, at.rear_hinge), (at.front, at.front_hinge)):
        centre, hinge = np.asarray(wheel.centre), np.asarray(hinge)
        radius = float(vehicle.wheel_radius)
        axis.add_patch(patches.Circle(centre, radius, fc=theme.SWING["slim"], ec=theme.INK, lw=2))
        axis.plot(*np.stack([centre, hinge]).T, color=theme.SUPPORT["mid"], lw=3)
        hinges.append(hinge)
    axis.plot(*np.stack(hinges).T, color=theme.HIP_EDGE, lw=7, solid_capstyle="round")
    axis.axhline(0.0, color=theme.INK, lw=1)
    axis.set_aspect("equal")
