"""Plots of panels of curves, written as PNG without a display. Needs the extra `viz`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.sheet import LEVEL, legend, make_sheet, name_panel, save_sheet, styled

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from stickslip.envs.rendering.page import Episode, Panel

ROW = 1.55
"""Height of a panel [inches]."""
HEADROOM = 0.3
"""Share of a panel's range that is added above the curves for the legend."""


def plot_episode(episode: Episode, path: str | Path, title: str) -> Path:
    """Plot all panels of an episode over its axis; return the path. Slips are shaded."""
    time = episode.period * np.arange(episode.samples)
    below, x = episode.axis or ("time [s]", time)
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
    """Plot panels over x [n], labelled `below`; return the path. slips: shaded where true [n], from
    the sample before each slip to its last one."""
    figure, axes = make_sheet(len(panels), 1, (9, ROW * len(panels) + 0.8), title)
    for axis, panel in zip(axes, panels, strict=True):
        style = "steps-pre" if panel.steps else "default"
        for line, colour in zip(panel.lines, theme.PLAYERS, strict=False):
            look = LEVEL if line.dashed else {"color": colour, "lw": 1.2}
            axis.plot(x, line.values, drawstyle=style, label=line.name, **look)
        name_panel(axis, f"{panel.title} [{panel.unit}]")
        for level in panel.limits:
            axis.axhline(level, **LEVEL)
        if len(panel.lines) > 1:
            low, high = axis.get_ylim()
            axis.set_ylim(low, high + HEADROOM * (high - low))
            legend(axis, ncols=len(panel.lines), loc="upper right")
        if slips is not None:
            edges = np.flatnonzero(np.diff(slips.astype(int), prepend=0, append=0)).reshape(-1, 2)
            for begin, end in edges:
                ends = float(x[max(begin - 1, 0)]), float(x[end - 1])
                axis.axvspan(*ends, color=theme.SLIDES, alpha=0.18, lw=0)
    axes[-1].set_xlabel(below)
    axes[-1].set_xlim(x[0], x[-1] if x[-1] > x[0] else x[0] + 1.0)
    return save_sheet(figure, path)
