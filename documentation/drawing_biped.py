"""The biped: the whole machine, and one leg with the numbers of its links."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from documentation.sketch import (
    BLUE,
    GREEN,
    INK,
    MUTED,
    PALE,
    RED,
    arc,
    arrow,
    bare,
    disc,
    frame,
    ground,
    label,
    level,
)
from stickslip.dynamics.biped import BipedParams, inverse_dynamics
from stickslip.envs.rendering.biped.linkage import BARS, Mechanism, Pose

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PHASE = 2.35
"""Crank angle of the supporting leg [rad]: its foot is behind, the other in the air."""
NUMBERS = ("11", "12", "5", "10", "4", "6", "9", "7", "3", "2")
"""Of BARS, in their order."""
RATE, ACCELERATION = 3.0, 15.0
"""Of the crank [rad/s, rad/s^2]: the ground's force acts behind the ankle, where it can be seen."""
OWN = ("E", "K", "C", "F", "H")
"""Pins of a leg that have the chapter's letters."""


def machine(figure: Figure) -> None:
    """Both legs, the hip, the frames, the angle, what pushes and what slides."""
    axes, mechanism = bare(figure), Mechanism(BipedParams.from_bars())
    pose, crank = mechanism.pose(PHASE), mechanism.crank
    ground(axes, np.array([-22.0, 14.0]) * crank, np.zeros(2))
    _leg(axes, mechanism, pose, 1, PALE)
    _leg(axes, mechanism, pose, 0, INK)
    _hip(axes, mechanism, pose)
    A, pin = pose.pins["A"][0], pose.pins["crank_pin"][0]
    level(axes, A, 4.2 * crank)
    arc(axes, A, 2.4 * crank, 0.0, PHASE)
    label(axes, A + crank * np.array([2.2, 1.6]), r"$\theta_8$", (6, 6), color=RED)
    arc(axes, A, 2.4 * crank, 2.9, 4.3, BLUE)
    label(axes, A + 2.4 * crank * np.array([np.cos(3.5), np.sin(3.5)]), "T", (-9, -3), color=BLUE)
    label(axes, pin, "crank pin", (-28, 8), fontsize=9, color=MUTED)
    foot = pose.pins["E"][0]
    frame(axes, foot + crank * np.array([-20.0, 0.0]), 4 * crank, ("x", "y"))
    walking = inverse_dynamics(BipedParams.from_bars(), PHASE, RATE, ACCELERATION)
    zmp = foot + np.array([float(walking.zmp), 0.0])
    arrow(axes, zmp, zmp + crank * np.array([0.0, 5.5]), RED)
    label(axes, zmp + crank * np.array([0.0, 5.5]), "N", (-9, 0), color=RED)
    arrow(axes, zmp, zmp + crank * np.array([3.6, 0.0]), RED)
    label(axes, zmp + crank * np.array([3.6, 0.0]), "f", (7, 7), color=RED)
    axes.plot(*zmp, "o", color=RED, ms=4, zorder=8)
    label(axes, zmp, "ZMP", (0, -11), fontsize=9, color=RED)
    slide = foot + crank * np.array([-5.0, -1.6])
    arrow(axes, slide, slide + crank * np.array([5.0, 0.0]), GREEN)
    label(axes, slide + crank * np.array([2.5, 0.0]), "$x_1$ (slide)", (0, -10), color=GREEN)
    label(axes, foot, "E", (-12, 10))
    label(axes, pose.pins["E"][1], "E'", (12, 10), color=MUTED)
    _words(axes, mechanism, pose)


def _words(axes: Axes, mechanism: Mechanism, pose: Pose) -> None:
    words = {
        "supporting leg": (pose.pins["knee_bar"][0], (46, 6), INK),
        "swinging leg": (pose.pins["knee_bar"][1], (46, -6), MUTED),
        "hip (link 13), with motor and payload": (pose.pins["B"][0], (118, 0), INK),
    }
    for text, (at, shift, colour) in words.items():
        label(axes, at, text, shift, fontsize=9, color=colour)
    label(axes, pose.pins["E"][0], "foot (1)", (74, -16), fontsize=9)
    label(axes, pose.pins["E"][1], "foot (1')", (-60, 12), fontsize=9, color=MUTED)


def leg(figure: Figure) -> None:
    """The supporting leg alone: numbers of links, letters of pins, angles of the equations."""
    axes, mechanism = bare(figure), Mechanism(BipedParams.from_bars())
    pose, crank = mechanism.pose(PHASE), mechanism.crank
    ground(axes, np.array([-12.0, 16.0]) * crank, np.zeros(2))
    _leg(axes, mechanism, pose, 0, INK, wide=4.0)
    _hip(axes, mechanism, pose)
    pins = {name: place[0] for name, place in pose.pins.items()}
    for number, (a, b, _) in zip(NUMBERS, BARS, strict=True):
        disc(axes, 0.5 * (pins[a] + pins[b]), number, (-17, 0) if number == "10" else (0, 0))
    disc(axes, pins["crank_pin"], "8", (-16, 2))
    disc(axes, pins["E"], "1", (-60, -14))
    disc(axes, pins["D"], "13", (26, 46))
    shifts = {"E": (-13, 6), "K": (-13, 6), "C": (-13, 4), "F": (0, 12), "H": (13, -4)}
    for name in OWN:
        label(axes, pins[name], name, shifts[name], weight="bold")
    label(axes, pins["slot_pin"], "P", (12, 8), weight="bold")
    for name, of, up in (
        ("E + d", "ankle_bar", 11),
        ("K + d", "knee_bar", -10),
        ("C + d", "C_bar", 11),
    ):
        label(axes, pins[of], name, (21, up), fontsize=9)
    for tail, number, radius in (("E", 6, 5.0), ("K", 3, 2.8), ("C", 7, 1.7)):
        _angle(axes, pins, tail, number, radius * crank)


HEADS = {"E": "K", "K": "C", "C": "crank_pin"}


def _angle(axes: Axes, pins: dict[str, np.ndarray], tail: str, number: int, radius: float) -> None:
    """The angle of the vector that begins at a pin."""
    along = pins[HEADS[tail]] - pins[tail]
    end = float(np.arctan2(along[1], along[0]))
    level(axes, pins[tail], 1.4 * radius)
    arc(axes, pins[tail], radius, 0.0, end)
    middle = pins[tail] + radius * np.array([np.cos(end / 2), np.sin(end / 2)])
    label(axes, middle, rf"$\theta_{number}$", (11, 5), color=RED)


def _leg(
    axes: Axes, mechanism: Mechanism, pose: Pose, which: int, colour: str, wide: float = 3.2
) -> None:
    """Bars, pins and sole of one leg."""
    above = 4 if which == 0 else 2
    widths = {"slim": 0.5, "mid": 0.75, "main": 1.0}
    for a, b, role in BARS:
        x, y = np.array([pose.pins[a][which], pose.pins[b][which]]).T
        axes.plot(x, y, color=colour, lw=wide * widths[role], solid_capstyle="round", zorder=above)
    for name, place in pose.pins.items():
        axes.plot(*place[which], "o", color=colour, mfc="white", ms=4.5, zorder=above + 1)
        if name == "E":
            ends = place[which] + np.outer([-mechanism.heel, mechanism.toe], pose.feet[which])
            axes.plot(*ends.T, color=colour, lw=1.6 * wide, solid_capstyle="butt", zorder=above)


def _hip(axes: Axes, mechanism: Mechanism, pose: Pose) -> None:
    """The hip's plate with its pins and slot, and the double crank."""
    A, B, D = (pose.pins[name][0] for name in "ABD")
    ahead = (B - A) / np.linalg.norm(B - A)
    turned = np.array([ahead, [-ahead[1], ahead[0]]])
    axes.fill(*(A + mechanism.hip_outline @ turned).T, color="#d7e3ee", zorder=1.5)
    axes.plot(*(A + mechanism.slot @ turned).T, color="white", lw=4, zorder=1.6)
    arms = pose.pins["crank_pin"]
    axes.plot(*arms.T, color=RED, lw=4, solid_capstyle="round", zorder=5)
    for name, place, shift in (("A", A, (-11, 9)), ("B", B, (11, 9)), ("D", D, (12, -6))):
        axes.plot(*place, "o", color=BLUE, ms=6, zorder=6)
        label(axes, place, name, shift, weight="bold", color=BLUE)
