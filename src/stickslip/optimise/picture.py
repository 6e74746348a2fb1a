"""Pictures of a drive over its track and of a gait. Needs the extra `viz`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from stickslip.agents.pictures.episodes import draw_panels, panel
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.scene import draw_machines
from stickslip.envs.rendering.sheet import LEVEL, WIDTH, make_sheet, name_panel, styled
from stickslip.envs.ugv.picture import station_frames, ugv_drawing

if TYPE_CHECKING:
    from jaxtyping import Float
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from stickslip.envs.rendering.drawing import Drawing
    from stickslip.optim import GaitProblem, GaitResult, PostureProblem, SlipTransfer, Station
    from stickslip.optim.posture.track_file import Survey

VEHICLES = 6
"""Drawn at most; fewer where they would cover each other."""
SIDES: dict[str, dict[str, Any]] = {
    "rear": {"color": theme.MOTOR},
    "front": {"color": theme.SLIDES, "ls": "--"},
}
"""Rear wheel or leg, front wheel or leg."""
LOWEST, HIGHEST, ACROSS = 0.9, 3.5, 7.0
"""Heights of the scene's panel at least and at most, and its width [inches]."""
MOSTLY = 0.95
"""Share of the friction used that is drawn whole where it grows without limit."""


@styled
def draw_drive(problem: PostureProblem, x: Float[np.ndarray, "n"]) -> Figure:
    """A drive's leg angles, torque and grip margins under the vehicle along the track.

    x: the leg angles, whether or not they meet the problem's constraints.
    """
    at = problem.stations(x)
    shown = _chosen(problem)
    vehicles = vehicles_drawing(problem, at, shown)
    left, right, bottom, top = extent = _extent(problem, vehicles)
    height = float(np.clip(ACROSS * (top - bottom) / (right - left) * 1.15, LOWEST, HIGHEST))
    heights = [height, 1.4, 1.4, 1.4]
    size = WIDTH, sum(heights) + 1.8
    figure, (scene, legs, torque, grip) = make_sheet(4, 1, size, heights=heights)
    p, least, most = problem.params, np.min(at.friction), np.max(at.friction)
    for leg, ((name, look), (F, N, mu)) in enumerate(zip(SIDES.items(), at.wheels, strict=True)):
        legs.plot(at.x, np.degrees(at.leg_angles[:, leg]), label=name, **look)
        grip.plot(at.x, mu * N - np.abs(F), label=name, **look)
    torques = at.motors[0].T
    looks = SIDES.values() if len(torques) == 2 else [{"color": theme.INK}]
    for look, M in zip(looks, torques, strict=True):
        torque.plot(at.x, M, **look)
    for end in (p.leg_angle_min, p.leg_angle_max):
        legs.axhline(float(np.degrees(end)), **LEVEL)
    torque.axhline(0.0, **LEVEL)
    grip.axhline(problem.min_grip, **LEVEL)
    legs.legend()
    name_panel(legs, "leg angles [°]", "90: straight down; more: outwards; dashed: limits")
    name_panel(torque, "torque on each wheel [N m]", "negative: drives forwards")
    mu = f"{least:.3g}" if least == most else f"{least:.3g} to {most:.3g}"
    note = f"μ = {mu}; dashed: the least allowed"
    name_panel(grip, "grip margin μ N − |F| [N]", note, "front wheel [m]")
    _draw_vehicles(scene, vehicles, extent)
    name_panel(scene, "along the track", f"{len(shown)} of {len(problem.x)} waypoints")
    return figure


@styled
def draw_ground(survey: Survey) -> Figure:
    """The points of a survey and the ground that is used, and the change of height at points."""
    figure, (height, change) = make_sheet(2, 1, (WIDTH, 4.4))
    (x, y), (at, ground) = survey.raw.T, survey.used.T
    height.plot(x, y, ".", color=theme.MUTED, ms=3, label="read")
    height.plot(at, ground, color=theme.MOTOR, label="used")
    change.plot(x, np.interp(x, at, ground) - y, ".", color=theme.INK, ms=2)
    change.axhline(0.0, **LEVEL)
    height.legend()
    most, rms = (survey.changes[f"{name}_change"] for name in ("largest", "rms"))
    name_panel(height, "height [m]", f"{len(x)} points read, {len(at)} used")
    note = f"of points that were kept: at most {most:.3g}, root mean square {rms:.3g}"
    name_panel(change, "used less read [m]", note, "x [m]")
    return figure


def _chosen(problem: PostureProblem) -> np.ndarray:
    """Waypoints to draw the vehicle at, evenly spaced, two or more."""
    p = problem.params
    length = float(p.body_length) + 3 * float(p.wheel_radius)
    room = int((problem.x[-1] - problem.x[0]) / length) + 1
    places = np.linspace(problem.x[0], problem.x[-1], max(min(room, VEHICLES), 2))
    return np.unique(np.argmin(np.abs(problem.x[:, None] - places), axis=0))


def _draw_vehicles(axis: Axes, vehicles: Drawing, extent: tuple[float, ...]) -> None:
    """The ground and the vehicles, to scale; sets both axes' limits."""
    left, right, bottom, top = extent
    x, y = vehicles.ground.T
    axis.fill_between(x, y, y.min() - (right - left), color=theme.floor_colour(0.8), lw=0, zorder=1)
    axis.plot(x, y, color=theme.INK, lw=1.2, zorder=4)
    draw_machines(axis, vehicles, 72 * ACROSS / (right - left) / 400)
    axis.set_xlim(left, right)
    axis.set_ylim(bottom - 0.1 * (top - bottom), top + 0.05 * (top - bottom), auto=True)


def vehicles_drawing(problem: PostureProblem, stations: Station, shown: np.ndarray) -> Drawing:
    """Drawing of the vehicle at some stations."""
    posture, at = problem.posture, stations.map(lambda of: np.asarray(of)[shown])
    with jax.enable_x64(True):
        ground = posture.odometer, posture.friction[shown], posture.params, problem.solver
        frames = station_frames(at, np.zeros(len(shown)), *ground)
    return ugv_drawing(frames, problem.params)


def _extent(problem: PostureProblem, vehicles: Drawing) -> tuple[float, float, float, float]:
    """Left, right, bottom and top of the vehicles [m]."""
    radius, points = float(problem.params.wheel_radius), vehicles.points
    left, bottom = points.min(axis=(0, 1)) - radius
    right, top = points.max(axis=(0, 1)) + radius
    return float(left), float(right), float(bottom), float(top)


@styled
def draw_gait(problem: GaitProblem, result: GaitResult) -> Figure:
    """Crank rate, torque and friction ratio of a result's gait over its steps."""
    gait = result.best
    figure, axes = make_sheet(3, 1, (WIDTH, 5.4))
    rate, torque, friction = axes
    turned = (gait.theta - np.pi / 2) / np.pi + np.arange(gait.grid.steps)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        use = np.where(gait.loaded, gait.friction_force / gait.normal_force, np.nan)
    for axis, values in zip(axes, (gait.crank_rate, gait.torque, use), strict=True):
        axis.plot(turned.T, values.T, color=theme.MOTOR)
        axis.set_xlim(0, gait.grid.steps)
    rate.axhline(gait.mean_rate, **LEVEL)
    limit, limits = problem.torque_limit, problem.on_grid.mu
    for sign in (1, -1):
        if limit is not None:
            torque.axhline(sign * float(limit), **LEVEL)
        for j, mu in enumerate([] if limits is None else limits):
            friction.plot([j, j + 1], [sign * mu] * 2, **LEVEL)
    if not gait.loaded.all():
        drawn = np.abs(use[gait.loaded])
        most = 1.5 * float(np.quantile(drawn, MOSTLY)) if drawn.size else 1.0
        friction.set_ylim(-most, most)
    name_panel(rate, "crank rate [rad/s]", "dashed: mean")
    name_panel(torque, "motor torque [N m]", "dashed: limit")
    below = "steps, from exchange to exchange"
    name_panel(friction, "friction / normal force [-]", "dashed: limit", below)
    return figure


def draw_slip(walk: SlipTransfer) -> Figure:
    """Crank rate, torque and the foot's velocity of a walk over time."""
    limit = walk.problem.torque_limit
    limits = () if limit is None else (-float(limit), float(limit))
    torque = np.pad(walk.torque, ((0, 0), (1, 0)), mode="edge")  # of the piece that ends there
    panels = (
        panel("crank rate", "rad/s", walk.crank_rate.ravel()),
        panel("motor torque", "N m", torque.ravel(), limits, steps=True),
        panel("foot velocity", "m/s", walk.foot_velocity.ravel()),
    )
    return draw_panels(panels, walk.clock.ravel(), "time [s]")
