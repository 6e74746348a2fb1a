"""A gait as a picture: the robot link by link at equal times, rate, torque and friction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.linkage import BARS, Mechanism
from stickslip.optimise.gait_report import presses
from stickslip.paper import drawing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from stickslip.optim import Gait, GaitProblem, GaitResult

ROBOTS, MOST_STEPS = 9, 3
"""Drawn at most, over so many of the gait's steps."""
MOSTLY = 0.95
"""Share of the friction used that is drawn whole where it grows without limit."""
APART = 0.85
"""From one picture to the next, in the robot's heights."""
WIDTHS = {"main": 2.4, "mid": 1.5, "slim": 0.9}


def draw_gait(problem: GaitProblem, result: GaitResult) -> Figure:
    """A matplotlib figure of a result. ValueError for one without a gait."""
    gait = result.best
    figure, axes = drawing.sheet(4, height=2.0, height_ratios=[1.0, 1, 1, 1])
    top, rate, torque, friction = axes[:, 0]
    draw_robots(top, problem, gait)
    turned = (gait.theta - np.pi / 2) / np.pi + np.arange(gait.grid.steps)[:, None]
    line = {"color": theme.MOTOR, "lw": 1.4}
    loaded = presses(gait)
    for j in range(gait.grid.steps):
        rate.plot(turned[j], gait.crank_rate[j], **line)
        torque.plot(turned[j], gait.torque[j], **line)
        with np.errstate(divide="ignore", invalid="ignore"):
            use = gait.friction_force[j] / gait.normal_force[j]
        use = np.where(loaded[j], use, np.nan)
        friction.plot(turned[j], use, color=theme.HOLDS, lw=1.4)
    drawing.mark(rate, y=gait.mean_rate)
    drawing.name_panel(rate, "crank rate [rad/s]", "dashed: mean")
    if problem.torque_limit is not None:
        for sign in (1, -1):
            drawing.mark(torque, y=sign * float(problem.torque_limit))
    limited = "" if problem.torque_limit is None else "dashed: limit"
    drawing.name_panel(torque, "motor's torque [N m]", limited)
    limits = problem.on_grid.limits.mu
    if limits is not None:
        for j, mu in enumerate(limits):
            for sign in (1, -1):
                friction.plot([j, j + 1], [sign * mu] * 2, color=theme.MUTED, lw=0.9, ls="--")
    notes = ["dashed: limit"] if limits is not None else []
    notes += [] if loaded.all() else ["gaps: nothing presses the foot down"]
    below = "steps, from exchange to exchange"
    drawing.name_panel(friction, "friction / normal force [-]", "; ".join(notes), below)
    if not loaded.all():
        drawn = np.abs(gait.friction_force[loaded] / gait.normal_force[loaded])
        most = 1.5 * float(np.quantile(drawn, MOSTLY)) if drawn.size else 1.0
        friction.set_ylim(-most, most)
    for axis in (rate, torque, friction):
        axis.set_xlim(0, gait.grid.steps)
    return figure


def draw_robots(axis: Axes, problem: GaitProblem, gait: Gait, robots: int = ROBOTS) -> None:
    """The robot at equal intervals of time, to scale, one picture beside the other."""
    steps = min(gait.grid.steps, MOST_STEPS)
    angle, time = _clock(gait, steps)
    instants = np.linspace(0, time[-1], max(robots, 2))
    mechanism = Mechanism(problem.params)
    apart = APART * mechanism.top
    for i, (instant, turned) in enumerate(
        zip(instants, np.interp(instants, time, angle), strict=True)
    ):
        step = min(int(turned / np.pi + 1e-9), steps - 1)
        draw_robot(axis, mechanism, np.pi / 2 + turned - np.pi * step, i * apart)
        note = f"{instant:.2f} s" if steps == 1 else f"{instant:.2f} s, step {step + 1}"
        axis.annotate(
            note,
            (i * apart, 0.0),
            xytext=(0, -12),
            textcoords="offset points",
            ha="center",
            fontsize=8,
            color=theme.MUTED,
            annotation_clip=False,
        )
    axis.axhline(0.0, color=theme.INK, lw=1.2)
    axis.set_aspect("equal")
    axis.set_xlim(-0.6 * apart, (len(instants) - 0.4) * apart)
    axis.set_ylim(-0.02 * mechanism.top, 1.06 * mechanism.top)
    axis.set_xticks([])
    axis.grid(visible=False)
    note = "dark: the supporting leg; blue: the crank"
    if steps < gait.grid.steps:
        note += f"; the first {steps} of {gait.grid.steps} steps"
    drawing.name_panel(axis, "link by link [m]", note)


def _clock(gait: Gait, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Crank angle turned [rad] and time [s] at the nodes of the first steps."""
    time = np.concatenate([[0.0], np.cumsum(np.minimum(gait.times[:steps], 1e3).ravel())])
    turned = gait.theta[:steps] - np.pi / 2 + np.pi * np.arange(steps)[:, None]
    return np.concatenate([[0.0], turned[:, 1:].ravel()]), time


def draw_robot(axis: Axes, mechanism: Mechanism, phase: float, at: float) -> None:
    """One robot with its supporting ankle at a place of the floor [m]."""
    pose = mechanism.pose(phase)

    def bar(a: np.ndarray, b: np.ndarray, colour: str, width: float) -> None:
        look = {"color": colour, "lw": width, "solid_capstyle": "round"}
        axis.plot([a[0] + at, b[0] + at], [a[1], b[1]], **look)

    for leg, colours in ((1, theme.SWING), (0, theme.SUPPORT)):
        for begin, end, width in BARS:
            bar(pose.pins[begin][leg], pose.pins[end][leg], colours[width], WIDTHS[width])
        ankle, ahead = pose.pins["E"][leg], pose.feet[leg]
        heel, toe = ankle - mechanism.heel * ahead, ankle + mechanism.toe * ahead
        bar(heel, toe, colours["main"], WIDTHS["main"])
        bar(pose.pins["A"][0], pose.pins["crank_pin"][leg], theme.MOTOR, 1.8)
    for one, other in (("A", "B"), ("B", "D")):
        bar(pose.pins[one][0], pose.pins[other][0], theme.HIP_EDGE, 1.2)
