"""Plots of episodes, written as PNG without a display. Needs the extra `viz`."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypedDict

import numpy as np

from stickslip.agents.biped.pictures.histories import Histories, histories
from stickslip.agents.pictures.sheet import make_sheet, name_below, save_sheet
from stickslip.dynamics.scene import Grip
from stickslip.envs.rendering import theme

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.dynamics.scene import Floor
    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.envs.biped.state import BipedEnvState

LINES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#1E2A36")
STYLES = ("-", "--", "-.", ":")
SLID = "distance slid [mm]"
SMALL = 0.42
"""Height of one controller's friction, in parts of the other panels'."""
CEILING = 1.6
"""Friction use beyond this is cut off in plots."""


class Look(TypedDict):
    """How a controller's lines are drawn."""

    color: str
    ls: str
    lw: float


def plot_episode(
    played: Rollout[BipedEnvState],
    params: BipedEnvParams,
    path: str | Path,
    title: str | None = None,
) -> Path:
    """One episode over time: torque, crank rate, P w, friction use, distance slid; return the path.

    Slides are shaded. Forces are those at the end of each control step.
    """
    course, limit = histories(played, params), float(params.torque_limit)
    return plot_course(course, params.scene.floor, path, title or "One episode", limit)


def plot_course(
    course: Histories, floor: Floor, path: str | Path, title: str, limit: float | None = None
) -> Path:
    """The same of any walk. limit: of the motor [N m], None for none."""
    figure, axes = _sheet(5, title)
    torque, rate, momentum, use, slid = axes
    _step(torque, course, course.torque, LINES[0])
    if limit is not None:
        for bound in (-limit, limit):
            torque.axhline(bound, color=theme.MUTED, lw=0.8, ls=(0, (4, 3)))
        torque.set_ylim(-1.1 * limit, 1.1 * limit)
    _name(torque, "torque [N m]", "" if limit is None else "dashed: the motor's limit")
    rate.plot(course.time, course.crank_rate, color=LINES[0], lw=1.2)
    _rate(rate, course)
    _momentum(momentum, [course])
    momentum.plot(course.time, course.momentum, color=LINES[0], lw=1.2)
    _friction(use, [course], floor)
    use.plot(course.time, np.minimum(course.friction_use, CEILING), color=LINES[0], lw=1.2)
    slid.plot(course.time, 1e3 * course.slid, color=LINES[0], lw=1.2)
    _name(slid, SLID, "since the start, either direction; shaded: the foot slips")
    for axis in axes:
        _shade(axis, course)
    slid.set_ylim(*_from_zero(1e3 * float(course.slid[-1])))
    return _save(figure, axes, [course], path)


def plot_comparison(
    played: Mapping[str, Rollout[BipedEnvState]],
    params: BipedEnvParams,
    path: str | Path,
    title: str | None = None,
) -> Path:
    """Several controllers in one scene over time: crank rate, P w, distance slid, and the friction
    use of each in a panel of its own."""
    if not played:
        raise ValueError("played is empty; accepted: at least one rollout")
    courses = {name: histories(one, params) for name, one in played.items()}
    every = list(courses.values())
    heights = [1.0, 1.0, *[SMALL] * len(every), 1.0]
    figure, axes = _sheet(len(heights), title or "Controllers compared", heights)
    rate, momentum, *uses, slid = axes
    _rate(rate, every[0])
    _momentum(momentum, every)
    for use in uses:
        _friction(use, every, params.scene.floor)
    for use in uses[1:]:
        _name(use, "", "")
    _name(slid, SLID, "since the start, either direction; linear below 1 mm; x: fell")
    for index, (name, course) in enumerate(courses.items()):
        look = Look(
            color=LINES[index % len(LINES)],
            ls=STYLES[index // len(LINES) % len(STYLES)],
            lw=1.3,
        )
        rate.plot(course.time, course.crank_rate, label=name, **look)
        momentum.plot(course.time, course.momentum, **look)
        _alone(uses[index], course, name, look)
        slid.plot(course.time, 1e3 * course.slid, **look)
        if course.time[-1] < max(one.time[-1] for one in every):
            slid.plot(course.time[-1], 1e3 * course.slid[-1], "x", color=look["color"], ms=7)
    _settle((rate, momentum, slid), every)
    figure.legend(
        loc="upper right",
        ncols=5,
        frameon=False,
        fontsize=9.5,
        handlelength=1.2,
        columnspacing=1.2,
    )
    return _save(figure, axes, every, path)


def _alone(axis: Axes, course: Histories, name: str, look: Look) -> None:
    """One controller's friction use, and its name."""
    axis.plot(course.time, np.minimum(course.friction_use, CEILING), **look)
    axis.set_yticks([0, 1])
    axis.set_title(name, loc="center", fontsize=9, color=look["color"], pad=3)


def _sheet(
    rows: int, title: str, heights: Sequence[float] | None = None
) -> tuple[Figure, list[Axes]]:
    tall = 1.75 * (rows if heights is None else sum(heights)) + 0.9
    return make_sheet(rows, 1, (11, tall), title, heights)


def _name(axis: Axes, label: str, note: str) -> None:
    """What is drawn and its unit, over the panel; the note beside it."""
    axis.set_title(label, loc="left", fontsize=10, color=theme.INK, pad=3)
    axis.set_title(note, loc="right", fontsize=8.5, color=theme.MUTED, pad=3)


def _step(axis: Axes, course: Histories, values: np.ndarray, colour: str) -> None:
    """A value held during each step, drawn from the step's start."""
    starts = np.concatenate([[0.0], course.time])
    held = np.append(values, values[-1:])
    axis.plot(starts, held, color=colour, lw=1.2, drawstyle="steps-post")


def _rate(axis: Axes, course: Histories) -> None:
    if course.commanded_rate is not None:
        axis.axhline(course.commanded_rate, color=theme.MUTED, lw=0.8, ls=(0, (4, 3)))
    note = "" if course.commanded_rate is None else "dashed: commanded mean"
    _name(axis, "crank rate [rad/s]", note)


def _momentum(axis: Axes, courses: list[Histories]) -> None:
    cruise, note = courses[0].cruise, "horizontal momentum, its slope is the friction"
    if cruise is not None:
        axis.axhline(cruise, color=theme.MUTED, lw=0.8, ls=(0, (4, 3)))
        note += "; dashed: at the commanded mean speed"
    _name(axis, "P(θ) · crank rate [kg m/s]", note)


def _friction(axis: Axes, courses: list[Histories], floor: Floor) -> None:
    grip = isinstance(floor, Grip)
    label = "|f| / N [-]" if grip else "friction use |f| / (μs N) [-]"
    axis.axhline(1.0, color=theme.SLIDES, lw=1.0, ls=(0, (4, 3)))
    _name(axis, label, "" if grip else "at 1 the foot breaks loose; while it slips, μk / μs")
    highest = max(float(np.max(course.friction_use, initial=0.0)) for course in courses)
    axis.set_ylim(0, min(max(1.1, 1.1 * highest), CEILING))


def _settle(axes: tuple[Axes, Axes, Axes], courses: list[Histories]) -> None:
    """Limits that a controller out of hand does not spoil for the others."""
    rate, momentum, slid = axes
    for axis, usual in ((rate, courses[0].commanded_rate), (momentum, courses[0].cruise)):
        if usual is None:
            continue
        low, high = axis.get_ylim()
        axis.set_ylim(max(low, -0.8 * usual), min(high, 2.2 * usual))
    slid.set_yscale("symlog", linthresh=1.0, linscale=0.6)
    farthest = 1e3 * max(float(course.slid[-1]) for course in courses)
    slid.set_ylim(-0.06, max(1.0, 1.5 * farthest))
    slid.set_yticks(ticks := [0, *(10.0**k for k in range(5) if 10.0**k <= max(1.0, farthest))])
    slid.set_yticklabels([f"{tick:g}" for tick in ticks])
    slid.minorticks_off()


def _from_zero(highest: float) -> tuple[float, float]:
    """Limits that show a line at zero."""
    top = max(1.0, 1.08 * highest)
    return -0.04 * top, top


def _shade(axis: Axes, course: Histories) -> None:
    """The steps in which the foot slid."""
    edges = np.diff(np.concatenate([[0], course.sliding.astype(int), [0]]))
    times = np.concatenate([[0.0], course.time])
    for begin, end in zip(np.nonzero(edges == 1)[0], np.nonzero(edges == -1)[0], strict=True):
        axis.axvspan(times[begin], times[end], color=theme.SLIDES, alpha=0.18, lw=0)


def _save(figure: Figure, axes: list[Axes], courses: list[Histories], path: str | Path) -> Path:
    name_below(axes[-1], "time [s]")
    longest = max(float(course.time[-1]) for course in courses)
    axes[-1].set_xlim(0, longest or 1.0)  # one that ends where it begins is drawn, too
    return save_sheet(figure, path)
