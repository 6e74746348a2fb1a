"""Plots of panels of curves, written as PNG without a display. Needs the extra `viz`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.sheet import LEVEL, legend, make_sheet, name_panel, save_sheet, styled

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from stickslip.envs.rendering.page import Episode, Panel

STYLES = ("-", "--", "-.", ":")
ROW = 1.55
"""Height of a panel [inches]."""


def plot_episode(episode: Episode, path: str | Path, title: str) -> Path:
    """Plot all panels of an episode over its axis; return the path. Slips are shaded."""
    below, x = _axis(episode)
    return plot_panels(episode.panels, x, below, path, title, episode.slips)


@styled
def plot_panels(
    panels: Sequence[Panel],
    x: np.ndarray,
    below: str,
    path: str | Path,
    title: str,
    slips: np.ndarray | None = None,
) -> Path:
    """Plot panels over x [n], labelled `below`; return the path. slips: shaded where true [n]."""
    figure, axes = make_sheet(len(panels), 1, (9, ROW * len(panels) + 0.8), title)
    for axis, panel in zip(axes, panels, strict=True):
        for line, colour in zip(panel.lines, theme.PLAYERS, strict=False):
            look = LEVEL if line.dashed else {"color": colour, "lw": 1.2}
            _curve(axis, x, panel, line.values, label=line.name, **look)
        _name(axis, panel)
        if len(panel.lines) > 1:
            legend(axis, ncols=len(panel.lines), loc="upper right")
        if slips is not None:
            _shade(axis, x, slips)
    return _save(figure, axes, x, below, path)


@styled
def plot_comparison(
    episodes: Sequence[Episode], panels: Mapping[str, str], path: str | Path, title: str
) -> Path:
    """Plot panels of several episodes over one axis; return the path.

    panels: titles of panels and the scale of each, "linear" or "symlog" (linear up to 1). Of each
    episode a panel's first line is drawn; dashed lines and limits are those of the first episode. A
    cross marks an early end. ValueError without an episode.
    """
    if not episodes:
        raise ValueError("episodes is empty; accepted: at least one")
    figure, axes = make_sheet(len(panels), 1, (9, 1.25 * ROW * len(panels) + 0.9), title)
    colours = [*theme.PLAYERS, theme.INK]
    for axis, (wanted, scale) in zip(axes, panels.items(), strict=True):
        own = [next(one for one in of.panels if one.title == wanted) for of in episodes]
        _name(axis, own[0])
        for line in own[0].lines:
            if line.dashed:
                _curve(axis, _axis(episodes[0])[1], own[0], line.values, **LEVEL)
        for index, (episode, panel) in enumerate(zip(episodes, own, strict=True)):
            look = {"color": colours[index % 7], "ls": STYLES[index // 7 % 4], "lw": 1.3}
            x, values = _axis(episode)[1], panel.lines[0].values
            _curve(axis, x, panel, values, label=episode.name, **look)
            if episode.ended:
                axis.plot(x[-1], values[-1], "x", color=look["color"], ms=7)
        if scale == "symlog":
            axis.set_yscale("symlog", linthresh=1.0, linscale=0.6)
        else:  # limits that one controller out of hand does not spoil for the others
            every = np.concatenate([one.lines[0].values for one in own])
            low, high = np.nanpercentile(every, (2, 98))
            room = 0.2 * (high - low) or 1.0
            axis.set_ylim(low - room, high + room)
    names = axes[0].get_legend_handles_labels()
    figure.legend(*names, ncols=6, loc="outside lower center", columnspacing=1.2)
    below, longest = _axis(max(episodes, key=lambda one: one.samples))
    return _save(figure, axes, longest, below, path)


def _axis(episode: Episode) -> tuple[str, np.ndarray]:
    """Label and values [n] of the horizontal axis."""
    return episode.axis or ("time [s]", episode.period * np.arange(episode.samples))


def _curve(axis: Axes, x: np.ndarray, panel: Panel, values: np.ndarray, **look: Any) -> None:
    axis.plot(x, values, drawstyle="steps-pre" if panel.steps else "default", **look)


def _name(axis: Axes, panel: Panel) -> None:
    """Title with the unit, and the limits."""
    name_panel(axis, f"{panel.title} [{panel.unit}]")
    for level in panel.limits:
        axis.axhline(level, **LEVEL)


def _shade(axis: Axes, x: np.ndarray, slips: np.ndarray) -> None:
    """Shade from the sample before each slip to its last one."""
    edges = np.flatnonzero(np.diff(slips.astype(int), prepend=0, append=0)).reshape(-1, 2)
    for begin, end in edges:
        axis.axvspan(
            float(x[max(begin - 1, 0)]), float(x[end - 1]), color=theme.SLIDES, alpha=0.18, lw=0
        )


def _save(
    figure: Figure, axes: Sequence[Axes], x: np.ndarray, below: str, path: str | Path
) -> Path:
    axes[-1].set_xlabel(below)
    axes[-1].set_xlim(x[0], x[-1] if x[-1] > x[0] else x[0] + 1.0)
    return save_sheet(figure, path)
