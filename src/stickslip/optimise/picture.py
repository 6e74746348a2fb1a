"""Pictures of a drive over its track and of a gait. Needs the extra `viz`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from stickslip.dynamics.scene import Scene
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.biped import BipedFrame, BipedSketch
from stickslip.envs.rendering.extras import require
from stickslip.envs.rendering.scene import draw_machine
from stickslip.envs.rendering.sheet import LEVEL, WIDTH, legend, make_sheet, name_panel, styled
from stickslip.envs.rendering.ugv import ugv_drawing
from stickslip.envs.ugv.picture import station_frames

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Array, Float
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from stickslip.envs.rendering.drawing import Drawing
    from stickslip.optim import Gait, GaitProblem, GaitResult, PostureProblem, Station

MOST_POINTS, RANGES, MEDIANS = 600, 300, 50
"""A curve of more points is drawn as its ranges and medians over so many stretches."""
VEHICLES = 6
"""Drawn at most; fewer where they would cover each other."""
REAR, FRONT = {"color": theme.MOTOR}, {"color": theme.SLIDES, "ls": "--"}
"""Rear wheel or leg, front wheel or leg."""
SIDES = ("rear", REAR), ("front", FRONT)
LOWEST, HIGHEST, ACROSS = 0.9, 3.5, 7.0
"""Heights of the scene's panel at least and at most, and its width [inches]."""
ROBOTS, MOST_STEPS = 9, 3
"""Drawn at most, over so many of the gait's steps."""
APART = 0.85
"""From one picture to the next, in the robot's heights."""
MOSTLY = 0.95
"""Share of the friction used that is drawn whole where it grows without limit."""


@styled
def draw_drive(problem: PostureProblem, x: Float[np.ndarray, "n"]) -> Figure:
    """A drive's leg angles, torque and grip margins under the vehicle along the track.

    x: the leg angles, whether or not they meet the problem's constraints.
    """
    stations = problem.stations(x)
    shown = chosen(problem, VEHICLES)
    vehicles = drawing_of(problem, stations, shown)
    tiny = len(stations.x) > MOST_POINTS
    heights = [1.2 if tiny else scene_height(problem, vehicles), 1.4, 1.4, 1.4]
    size = WIDTH, sum(heights) + 1.8
    figure, (top, legs, torque, grip) = make_sheet(4, 1, size, heights=heights)
    draw_angles(legs, stations)
    for end in (problem.params.leg_angle_min, problem.params.leg_angle_max):
        legs.axhline(float(np.degrees(end)), **LEVEL)
    name_panel(legs, "leg angles [°]", "90: straight down; more: outwards; dashed: limits")
    draw_curve(torque, stations.x, stations.torque, color=theme.INK)
    torque.axhline(0.0, **LEVEL)
    note = "; lines: medians, bands: ranges" if tiny else ""
    name_panel(torque, "torque on each wheel [N m]", "negative: drives forwards" + note)
    for (name, look), (F, N, mu) in zip(SIDES, stations.wheels, strict=True):
        draw_curve(grip, stations.x, mu * N - np.abs(F), label=name, **look)
    grip.axhline(problem.min_grip, **LEVEL)
    least, most = np.min(stations.friction), np.max(stations.friction)
    mu = f"{least:.3g}" if least == most else f"{least:.3g} to {most:.3g}"
    legend(grip)
    note = f"μ = {mu}; dashed: the least allowed"
    name_panel(grip, "grip margin μ N − |F| [N]", note, "front wheel [m]")
    if tiny:
        draw_profile(top, problem)
        return figure
    draw_vehicles(top, problem, vehicles)
    name_panel(top, "along the track", f"{len(shown)} of {len(problem.x)} waypoints")
    return figure


def draw_profile(axis: Axes, problem: PostureProblem) -> None:
    """The height of the ground, where vehicles to scale would be too small to see."""
    x = np.asarray(problem.x)
    with jax.enable_x64(True):
        height = np.asarray(problem.track.height(x))
    axis.fill_between(x, height, height.min() - 0.1 * np.ptp(height), color=theme.floor_colour(0.8))
    axis.plot(x, height, color=theme.INK)
    axis.set_xlim(x[0], x[-1])
    name_panel(axis, "height of the ground [m]", f"{len(x)} waypoints; another scale upwards")


def chosen(problem: PostureProblem, most: int) -> np.ndarray:
    """Waypoints to draw the vehicle at, evenly spaced, two or more."""
    p = problem.params
    length = float(p.body_length) + 3 * float(p.wheel_radius)
    room = int((problem.x[-1] - problem.x[0]) / length) + 1
    places = np.linspace(problem.x[0], problem.x[-1], max(min(room, most), 2))
    return np.unique(np.argmin(np.abs(problem.x[:, None] - places), axis=0))


def scene_height(problem: PostureProblem, vehicles: Drawing) -> float:
    """Height of the scene's panel for equal scales [inches], within the page."""
    left, right, bottom, top = _extent(problem, vehicles.points)
    return float(np.clip(ACROSS * (top - bottom) / (right - left) * 1.15, LOWEST, HIGHEST))


def draw_angles(axis: Axes, stations: Station) -> None:
    """Both leg angles in degrees."""
    for leg, (name, look) in enumerate(SIDES):
        draw_curve(axis, stations.x, np.degrees(stations.leg_angles[:, leg]), label=name, **look)
    axis.yaxis.set_major_locator(require("matplotlib.ticker").MultipleLocator(30))
    legend(axis)


def draw_curve(
    axis: Axes,
    x: Float[Array | np.ndarray, "n"],
    values: Float[Array | np.ndarray, "n"],
    **look: Any,
) -> None:
    """A curve; of more than MOST_POINTS a band over its range and a line of its medians.

    A longer curve swings many times within a pixel and would be a block of colour.
    """
    if len(x) <= MOST_POINTS:
        axis.plot(x, values, **look)
        return
    low, high = (_by_stretches(values, RANGES, of) for of in (np.min, np.max))
    middle = _by_stretches(x, RANGES, np.mean)
    axis.fill_between(middle, low, high, color=look["color"], alpha=0.25, lw=0)
    axis.plot(*(_by_stretches(of, MEDIANS, np.median) for of in (x, values)), **look)


def _by_stretches(values: Float[Array | np.ndarray, "n"], count: int, of: Callable) -> np.ndarray:
    """`of` the values in each of `count` stretches of equal numbers [count]."""
    return np.array([of(part) for part in np.array_split(values, count)])


def draw_vehicles(axis: Axes, problem: PostureProblem, vehicles: Drawing) -> None:
    """The ground and the vehicles, to scale; sets both axes' limits. Where x axes are shared, draw
    this one last."""
    left, right, bottom, top = _extent(problem, vehicles.points)
    x, y = vehicles.ground.T
    axis.fill_between(x, y, y.min() - (right - left), color=theme.floor_colour(0.8), lw=0, zorder=1)
    axis.plot(x, y, color=theme.INK, lw=1.2, zorder=4)
    for k in range(len(vehicles.points)):
        draw_machine(axis, vehicles, k, 72 * ACROSS / (right - left) / 400)
    axis.grid(visible=False)
    axis.set_yticks([])
    axis.set_xlim(left, right)
    axis.set_ylim(bottom - 0.1 * (top - bottom), top + 0.05 * (top - bottom), auto=True)
    axis.set_aspect("equal", adjustable="datalim")


def drawing_of(problem: PostureProblem, stations: Station, shown: np.ndarray) -> Drawing:
    """Drawing of the vehicle at some stations."""
    posture, at = problem.posture, stations.map(lambda of: np.asarray(of)[shown])
    friction = np.broadcast_to(posture.friction, len(problem.x))[shown]
    with jax.enable_x64(True):
        costs = np.zeros(len(shown))
        ground = posture.odometer, friction, posture.params, problem.solver
        frames = station_frames(at, costs, *ground)
    return ugv_drawing(frames, problem.params)


def _extent(problem: PostureProblem, points: np.ndarray) -> tuple[float, float, float, float]:
    """Left, right, bottom and top of the vehicles [m]."""
    radius = float(problem.params.wheel_radius)
    left, bottom = points.min(axis=(0, 1)) - radius
    right, top = points.max(axis=(0, 1)) + radius
    return float(left), float(right), float(bottom), float(top)


@styled
def draw_gait(problem: GaitProblem, result: GaitResult) -> Figure:
    """The robot link by link at equal times, rate, torque and friction of a result's gait.

    ValueError for a result without one.
    """
    gait = result.best
    figure, (top, rate, torque, friction) = make_sheet(
        4, 1, (WIDTH, 7.0), heights=[1, 1, 1, 1], sharex=False
    )
    draw_robots(top, problem, gait)
    turned = (gait.theta - np.pi / 2) / np.pi + np.arange(gait.grid.steps)[:, None]
    loaded = gait.loaded
    with np.errstate(divide="ignore", invalid="ignore"):
        use = np.where(loaded, gait.friction_force / gait.normal_force, np.nan)
    curves = (rate, gait.crank_rate), (torque, gait.torque), (friction, use)
    for axis, values in curves:
        axis.plot(turned.T, values.T, color=theme.MOTOR)
        axis.set_xlim(0, gait.grid.steps)
    rate.axhline(gait.mean_rate, **LEVEL)
    name_panel(rate, "crank rate [rad/s]", "dashed: mean")
    limit, limits = problem.torque_limit, problem.on_grid.limits.mu
    for sign in (1, -1):
        if limit is not None:
            torque.axhline(sign * float(limit), **LEVEL)
        for j, mu in enumerate([] if limits is None else limits):
            friction.plot([j, j + 1], [sign * mu] * 2, **LEVEL)
    name_panel(torque, "motor torque [N m]", "" if limit is None else "dashed: limit")
    notes = ["dashed: limit"] if limits is not None else []
    if not loaded.all():
        notes.append("gaps: nothing presses the foot down")
        drawn = np.abs(use[loaded])
        most = 1.5 * float(np.quantile(drawn, MOSTLY)) if drawn.size else 1.0
        friction.set_ylim(-most, most)
    below = "steps, from exchange to exchange"
    name_panel(friction, "friction / normal force [-]", "; ".join(notes), below)
    return figure


def draw_robots(axis: Axes, problem: GaitProblem, gait: Gait) -> None:
    """The robot at equal intervals of time, to scale, one picture beside the other."""
    steps = min(gait.grid.steps, MOST_STEPS)
    time = np.concatenate([[0.0], np.cumsum(np.minimum(gait.times[:steps], 1e3).ravel())])
    angles = gait.theta[:steps, 1:] - np.pi / 2 + np.pi * np.arange(steps)[:, None]
    instants = np.linspace(0, time[-1], ROBOTS)
    turned = np.interp(instants, time, np.concatenate([[0.0], angles.ravel()]))
    step = np.minimum((turned / np.pi + 1e-9).astype(int), steps - 1)
    sketch = BipedSketch(problem.params, Scene.grip())
    top = sketch.mechanism.top
    apart = APART * top
    places = apart * np.arange(ROBOTS)
    frames = BipedFrame(np.pi / 2 + turned - np.pi * step, floor_position=places)
    drawing = sketch.drawing(frames, np.empty((0, 4)))
    for i, instant in enumerate(instants):
        draw_machine(axis, drawing, i, 0.3)
        note = f"{instant:.2f} s" + ("" if steps == 1 else f", step {step[i] + 1}")
        axis.text(i * apart, -0.16 * top, note, ha="center", fontsize=8, color=theme.MUTED)
    ground = drawing.ground[0, 1]
    axis.axhline(ground, color=theme.INK, lw=1.2)
    axis.set_aspect("equal")
    axis.set_xlim(-0.6 * apart, (ROBOTS - 0.4) * apart)
    axis.set_ylim(-0.2 * top, 1.06 * top)
    axis.set_axis_off()
    note = "dark: the supporting leg; blue: the crank"
    if steps < gait.grid.steps:
        note += f"; the first {steps} of {gait.grid.steps} steps"
    name_panel(axis, "the robot at equal times", note)
