"""The half vehicle on a bump, with the symbols of its equations."""

from __future__ import annotations

from math import pi, radians
from typing import TYPE_CHECKING

import numpy as np

from documentation.sketch import (
    BLUE,
    GREEN,
    INK,
    MUTED,
    RED,
    arc,
    arrow,
    bare,
    frame,
    ground,
    label,
)
from stickslip.dynamics.ugv import Equilibrium, Pose, Track, UGVParams, equilibrium

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEG_ANGLES = (radians(62.0), radians(112.0))
X_FRONT = 3.55
FORCE = 1.6e-4
"""Length of an arrow [m/N]."""


def vehicle(figure: Figure) -> None:
    """Body, legs and wheels where they stand, their angles, and all forces."""
    axes, params, track = bare(figure), UGVParams(), Track.bump(height=0.3, width=0.8)
    found = equilibrium(params, track, X_FRONT, np.array(LEG_ANGLES))
    where = found.pose
    x = np.linspace(X_FRONT - 1.5, X_FRONT + 0.72, 200)
    ground(axes, x, np.asarray(track.height(x)))
    for wheel, hinge in ((where.rear, where.rear_hinge), (where.front, where.front_hinge)):
        _wheel(axes, params, np.asarray(wheel.centre), np.asarray(hinge))
    hinges = np.array([where.rear_hinge, where.front_hinge])
    axes.plot(*hinges.T, color=BLUE, lw=7, solid_capstyle="round", zorder=5)
    axes.plot(*hinges.T, "o", color="white", mec=BLUE, ms=6, zorder=6)
    _angles(axes, where)
    _forces(axes, found)
    _words(axes, params, where)
    frame(axes, np.array([x[0] + 0.03, 0.42]), 0.18, ("x", "y"))


def _wheel(axes: Axes, params: UGVParams, centre: np.ndarray, hinge: np.ndarray) -> None:
    turn = np.linspace(0.0, 2 * pi, 80)
    rim = float(params.wheel_radius) * np.stack([np.cos(turn), np.sin(turn)])
    axes.fill(*(centre[:, None] + rim), facecolor="#eef1f4", edgecolor=INK, lw=1.6, zorder=3)
    axes.plot(*np.array([hinge, centre]).T, color=INK, lw=4, solid_capstyle="round", zorder=4)
    axes.plot(*centre, "o", color="white", mec=INK, ms=6, zorder=5)


def _angles(axes: Axes, where: Pose) -> None:
    """Leg angles from the body, the body's pitch and the slopes under the wheels."""
    pitch = float(where.pitch)
    rear, front = np.asarray(where.rear_hinge), np.asarray(where.front_hinge)
    arc(axes, rear, 0.15, pitch, pitch - LEG_ANGLES[0])
    label(axes, rear + np.array([0.16, -0.13]), r"$\varphi_r$", (6, 0), color=RED)
    arc(axes, front, 0.15, pitch + pi, pitch + pi + LEG_ANGLES[1])
    label(axes, front + np.array([-0.16, -0.13]), r"$\varphi_f$", (-6, 0), color=RED)
    for wheel, name in ((where.rear, "r"), (where.front, "f")):
        at, along = np.asarray(wheel.point), np.asarray(wheel.tangent)
        slope = float(np.arctan2(along[1], along[0]))
        axes.plot(*np.array([at, at + 0.5 * along]).T, color=MUTED, lw=0.9, zorder=2)
        axes.plot(
            *np.array([at, at + np.array([0.5, 0.0])]).T, color=MUTED, lw=0.9, ls="--", zorder=2
        )
        end = at + 0.5 * np.array([np.cos(slope / 2), np.sin(slope / 2)])
        label(axes, end, rf"$\beta_{name}$", (10, 0), color=RED, fontsize=9)


def _forces(axes: Axes, found: Equilibrium) -> None:
    wheels = (
        (found.pose.rear, found.F_rear, found.N_rear, "r"),
        (found.pose.front, found.F_front, found.N_front, "f"),
    )
    for wheel, friction, normal, name in wheels:
        at, along = np.asarray(wheel.point), np.asarray(wheel.tangent)
        across = np.array([-along[1], along[0]])
        tip = at + FORCE * float(normal) * across
        arrow(axes, at, tip, GREEN)
        label(axes, tip, f"$N_{name}$", (13, 2), color=GREEN)
        tip = at + 3 * FORCE * float(friction) * along
        arrow(axes, at, tip, GREEN)
        label(axes, tip, f"$F_{name}$", (2, -12), color=GREEN)
        centre = np.asarray(wheel.centre)
        arc(axes, centre, 0.15, 0.9, -0.7, BLUE)
        label(axes, centre + np.array([0.15, 0.0]), "M", (9, 2), color=BLUE)
    body = np.asarray(found.pose.body)
    arrow(axes, body, body - np.array([0.0, 0.3]), MUTED)
    label(axes, body - np.array([0.0, 0.22]), "$m_b g$", (18, 0), color=MUTED)


def _words(axes: Axes, params: UGVParams, where: Pose) -> None:
    rear, front = np.asarray(where.rear_hinge), np.asarray(where.front_hinge)
    label(axes, 0.5 * (rear + front), "body, length L", (0, 16))
    label(axes, 0.5 * (rear + np.asarray(where.rear.centre)), "l", (-12, 6))
    label(axes, 0.5 * (front + np.asarray(where.front.centre)), "l", (12, 6))
    centre = np.asarray(where.rear.centre)
    rim = centre + float(params.wheel_radius) * np.array([-1.0, 0.0])
    arrow(axes, centre, rim, MUTED)
    label(axes, 0.5 * (centre + rim), "r", (0, 7), color=MUTED)
    label(axes, rear, "hinge", (-26, 6), fontsize=9, color=MUTED)
    at = np.asarray(where.front.point)
    axes.plot(*at, "o", color=INK, ms=4, zorder=8)
    label(axes, at, r"$x_{front}$", (8, -22), fontsize=9)
