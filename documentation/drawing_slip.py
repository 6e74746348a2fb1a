"""Stick, slip, stick again, and the exchange of support: a walk on a floor that is too slippery."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from documentation.sketch import BLUE, GREEN, INK, MUTED, RED
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, RK4Split, simulate_inverse
from stickslip.envs.rendering import theme

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RATE, MU_STATIC, MU_KINETIC = 3.0, 0.05, 0.04
SECONDS, DT = 2.3, 0.005
COLOURS = {"slip": RED, "stick": GREEN, "exchange": BLUE}


def walk(figure: Figure) -> None:
    """Friction used, velocity of the foot and its slide over time, with the events' lines."""
    trajectory = simulate_inverse(
        BipedParams.from_bars(),
        Scene.uniform(MU_STATIC, MU_KINETIC),
        BipedState(crank_rate=RATE),
        0.0,
        SECONDS,
        dt=DT,
        integrator=RK4Split(record_events=True),
    )
    time = np.asarray(trajectory.states.time)
    velocity = np.asarray(trajectory.states.foot_velocity)
    contacts = trajectory.contacts
    use = np.asarray(contacts.friction_force) / np.asarray(contacts.normal_force)
    used, speed, slid = figure.subplots(3, 1, sharex=True)
    used.plot(time[1:], use, color=INK, lw=1.3)
    for sign in (-1, 1):
        used.axhline(sign * MU_STATIC, color=MUTED, lw=0.9, ls=(0, (4, 3)))
        used.axhline(sign * MU_KINETIC, color=MUTED, lw=0.7, ls=":")
    speed.plot(time, 1000 * velocity, color=INK, lw=1.3)
    slid.plot(time, 1000 * np.asarray(trajectory.states.foot_position), color=INK, lw=1.3)
    words = (
        (used, "friction force / normal force [-]", r"dashed: $\pm\mu_s$, dotted: $\pm\mu_k$"),
        (speed, "velocity of the foot over the floor [mm/s]", "zero: it sticks"),
        (slid, "slide $x_1$ [mm]", "from the foothold without slip"),
    )
    sliding = np.abs(velocity) > 0.0
    for axes, title, note in words:
        _panel(axes, title, note, time, sliding)
        for when, kind, _ in trajectory.events():
            wide, faint = (4.0, 0.35) if kind == "exchange" else (1.0, 1.0)
            axes.axvline(when, color=COLOURS[kind], lw=wide, alpha=faint, zorder=1)
    slid.set_xlabel("time [s]", color=MUTED)
    _legend(figure)


def _panel(axes: Axes, title: str, note: str, time: np.ndarray, sliding: np.ndarray) -> None:
    axes.set_title(title, loc="left", fontsize=10, color=INK)
    axes.set_title(note, loc="right", fontsize=9, color=MUTED)
    axes.fill_between(
        time,
        0,
        1,
        where=list(sliding),
        color=theme.SLIDES,
        alpha=0.1,
        lw=0,
        transform=axes.get_xaxis_transform(),
    )
    axes.tick_params(colors=MUTED, labelsize=9, length=0)
    axes.margins(x=0.0)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _legend(figure: Figure) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    lines = [Line2D([], [], color=colour, label=kind) for kind, colour in COLOURS.items()]
    shade = Patch(facecolor=theme.SLIDES, alpha=0.2, label="the foot slides")
    figure.legend(
        handles=[*lines, shade], loc="outside upper center", ncols=4, frameon=False, fontsize=9
    )
