"""The UGV and its ground in a matplotlib panel, to scale. Needs the extra `viz`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.ugv import Pose, PoseSolver, Track, UGVParams, pose
from stickslip.dynamics.ugv.pose_solver import NEWTON
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require

if TYPE_CHECKING:
    from jaxtyping import Float

POINTS = 1200
"""Of the ground's line."""


def poses(
    params: UGVParams,
    track: Track,
    x: Float[np.ndarray, "n"],
    leg_angles: Float[np.ndarray, "n 2"],
    solver: PoseSolver = NEWTON,
) -> Pose:
    """Poses of the vehicle with its front wheel at each x [m], as NumPy float64 arrays."""
    with jax.enable_x64(True):
        vehicle, ground = jax.tree.map(lambda leaf: np.asarray(leaf, np.float64), (params, track))
        placed = pose(vehicle, ground, jnp.asarray(x), jnp.asarray(leg_angles), solver=solver)
        return jax.tree.map(np.asarray, placed)


def extent(params: UGVParams, placed: Pose) -> tuple[float, float, float, float]:
    """Extent of the vehicles: left, right, bottom, top [m], wheels included."""
    r = float(params.wheel_radius)
    wheels = np.concatenate([placed.rear.centre, placed.front.centre])
    hinges = np.concatenate([placed.rear_hinge, placed.front_hinge])
    thick = 0.1 * float(params.body_length)
    low, high = np.min(wheels, axis=0) - r, np.max(wheels, axis=0) + r
    left, bottom = np.minimum(low, np.min(hinges, axis=0) - thick)
    right, top = np.maximum(high, np.max(hinges, axis=0) + thick)
    return float(left), float(right), float(bottom), float(top)


def draw_scene(
    axis: Any,
    params: UGVParams,
    track: Track,
    placed: Pose,
    across: tuple[float, float] | None = None,
) -> None:
    """The ground from end to end and all vehicles; equal scales, the panel's box kept.

    placed: poses [n]. across: from where to where [m], else as far as the vehicles. The x limits
    are set, the y limits follow from them and the box. Where x axes are shared, draw this one last.
    """
    left, right, bottom, top = extent(params, placed)
    left, right = (left, right) if across is None else across
    span = right - left
    x = np.linspace(left - 0.1 * span, right + 0.1 * span, POINTS)
    with jax.enable_x64(True):
        y = np.asarray(track.height(jnp.asarray(x)))
    deep = float(np.min(y)) - span
    axis.fill_between(x, y, deep, color=theme.floor_colour(0.8), lw=0, zorder=1)
    axis.plot(x, y, color=theme.INK, lw=1.2, zorder=4)
    for k in range(len(placed.pitch)):
        draw_vehicle(axis, params, jax.tree.map(lambda of, k=k: of[k], placed))
    axis.grid(visible=False)
    axis.set_yticks([])
    axis.set_xlim(left - 0.01 * span, right + 0.01 * span)
    axis.set_ylim(bottom - 0.1 * (top - bottom), top + 0.05 * (top - bottom), auto=True)
    axis.set_aspect("equal", adjustable="datalim")


def draw_vehicle(axis: Any, params: UGVParams, placed: Pose) -> None:
    """One vehicle: wheels, legs, body, hinges; all in metres, lines included."""
    patches = require("matplotlib.patches")
    r, L = float(params.wheel_radius), float(params.body_length)
    sides = ((placed.rear, placed.rear_hinge), (placed.front, placed.front_hinge))
    for wheel, _ in sides:
        look = {"facecolor": theme.SUPPORT["main"], "edgecolor": theme.PANEL, "lw": 0.8}
        axis.add_patch(patches.Circle(wheel.centre, r, **look, zorder=2))
        axis.add_patch(
            patches.Circle(wheel.centre, 0.7 * r, color=theme.SWING["slim"], lw=0, zorder=2.1)
        )
    a, b = placed.rear_hinge, placed.front_hinge
    along = (b - a) / np.hypot(*(b - a))
    up = np.array([-along[1], along[0]])
    h = 0.06 * L
    corners = [a - h * (along + up), b + h * (along - up), b + 1.4 * h * along + 0.2 * h * up]
    corners += [b + h * (1.8 * up - 0.2 * along), a + h * (1.8 * up - along)]
    body = patches.Polygon(corners, facecolor=theme.HIP, edgecolor=theme.HIP_EDGE, lw=1, zorder=3)
    axis.add_patch(body)
    for wheel, hinge in sides:
        _bar(axis, hinge, wheel.centre, 0.055 * L, patches)
        for centre, edge in ((hinge, theme.HIP_EDGE), (wheel.centre, theme.MOTOR)):
            dot = patches.Circle(
                centre, 0.035 * L, facecolor=theme.PAGE, edgecolor=edge, zorder=3.4
            )
            axis.add_patch(dot)


def _bar(axis: Any, a: Any, b: Any, width: float, patches: Any) -> None:
    """A leg as a box, cased so that it stands apart from what is behind it."""
    along = (b - a) / np.hypot(*(b - a))
    across = 0.5 * width * np.array([-along[1], along[0]])
    box = [a + across, b + across, b - across, a - across]
    look = {"facecolor": theme.SUPPORT["mid"], "edgecolor": theme.PANEL, "lw": 0.8}
    axis.add_patch(patches.Polygon(box, **look, zorder=3.2))
