"""A drive along the track as a picture: the vehicle, leg angles, torque and grip."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require
from stickslip.optimise.vehicle import draw_scene, extent, poses
from stickslip.paper import drawing

if TYPE_CHECKING:
    from jaxtyping import Float
    from matplotlib.axes import Axes

    from stickslip.dynamics.ugv import Pose
    from stickslip.optim import PostureProblem, PostureResult, Station

VEHICLES = 6
"""Drawn at most; fewer where they would cover each other."""
REAR, FRONT = {"color": theme.MOTOR, "lw": 1.4}, {"color": theme.SLIDES, "lw": 1.4, "ls": "--"}
"""Rear wheel or leg, front wheel or leg."""
LOWEST, HIGHEST, PANEL, WIDTH = 0.9, 4.0, 1.5, 8.3
"""Heights of the scene's panel at least and at most, of the others; width of all [inches]."""


def draw_result(problem: PostureProblem, result: PostureResult, vehicles: int = VEHICLES) -> Any:
    """A matplotlib figure of a result: the vehicle along the track, angles, torque, grip margins.

    vehicles: how many are drawn at most. Everything stands over the place of the front wheel [m].
    ValueError for a result without a point.
    """
    if result.x is None:
        raise ValueError(f"the result holds no drive ({result.message}); accepted: one with x")
    return draw_drive(problem, result.x, vehicles)


def draw_drive(problem: PostureProblem, x: Float[np.ndarray, "n"], vehicles: int = VEHICLES) -> Any:
    """The same of a drive's leg angles, whether or not they meet the problem's constraints."""
    stations = problem.stations(x)
    shown = chosen(problem, vehicles)
    angles = problem.angles(x)[shown]
    placed = poses(problem.params, problem.track, problem.x[shown], angles)
    scene = scene_height(problem, placed)
    ratios = [scene, PANEL, PANEL, PANEL]
    height = (sum(ratios) + 4 * 0.35) / 4
    figure, axes = drawing.sheet(4, height=height, sharex=True, height_ratios=ratios)
    top, legs, torque, grip = axes[:, 0]
    draw_angles(legs, problem, stations)
    draw_torque(torque, stations)
    draw_grip(grip, problem, stations)
    draw_scene(top, problem.params, problem.track, placed)
    drawing.name_panel(top, "along the track", f"{len(shown)} of {len(problem.x)} waypoints")
    return figure


def chosen(problem: PostureProblem, most: int) -> np.ndarray:
    """Waypoints to draw the vehicle at, evenly spaced, two or more."""
    p = problem.params
    length = float(p.body_length) + 3 * float(p.wheel_radius)
    room = int((problem.x[-1] - problem.x[0]) / length) + 1
    places = np.linspace(problem.x[0], problem.x[-1], max(min(room, most), 2))
    return np.unique(np.argmin(np.abs(problem.x[:, None] - places), axis=0))


def scene_height(problem: PostureProblem, placed: Pose) -> float:
    """Height of the scene's panel for equal scales [inches], within the page."""
    left, right, bottom, top = extent(problem.params, placed)
    return float(np.clip(WIDTH * (top - bottom) / (right - left) * 1.15, LOWEST, HIGHEST))


def draw_angles(axis: Axes, problem: PostureProblem, stations: Station) -> None:
    """Both leg angles in degrees; the range dashed."""
    for leg, (name, look) in enumerate((("rear", REAR), ("front", FRONT))):
        axis.plot(stations.x, np.degrees(stations.leg_angles[:, leg]), label=name, **look)
    for end in (problem.params.leg_angle_min, problem.params.leg_angle_max):
        drawing.mark(axis, y=float(np.degrees(end)))
    axis.yaxis.set_major_locator(require("matplotlib.ticker").MultipleLocator(30))
    drawing.legend(axis)
    drawing.name_panel(axis, "leg angles [°]", "90: straight down; more: outwards; dashed: limits")


def draw_torque(axis: Axes, stations: Station) -> None:
    """The torque of each wheel."""
    axis.plot(stations.x, stations.torque, color=theme.INK, lw=1.4)
    drawing.mark(axis, y=0.0)
    drawing.name_panel(axis, "torque on each wheel [N m]", "negative: drives forwards")


def draw_grip(axis: Axes, problem: PostureProblem, stations: Station) -> None:
    """Draw the grip margin of each wheel; below 0 it slips."""
    looks = (("rear", REAR), ("front", FRONT))
    for (name, look), (F, N, mu) in zip(looks, stations.wheels, strict=True):
        axis.plot(stations.x, mu * N - np.abs(F), label=name, **look)
    drawing.mark(axis, y=problem.min_grip)
    least, most = np.min(stations.friction), np.max(stations.friction)
    mu = f"{least:.3g}" if least == most else f"{least:.3g} to {most:.3g}"
    drawing.legend(axis)
    drawing.name_panel(
        axis, "grip margin μ N − |F| [N]", f"μ = {mu}; dashed: the least allowed", "front wheel [m]"
    )
