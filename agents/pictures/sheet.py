"""Sheets of plots in one style, written as PNG without a display. Needs the extra `viz`."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def make_sheet(
    rows: int,
    columns: int,
    size: tuple[float, float],
    title: str,
    heights: Sequence[float] | None = None,
) -> tuple[Figure, list[Axes]]:
    """A figure of `size` [inches] with a title, and its rows * columns axes, which share x.

    heights: of the rows, in parts of each other; None: all the same.
    """
    figure = require("matplotlib.figure").Figure(
        figsize=size, dpi=110, facecolor=theme.PAGE, layout="constrained"
    )
    require("matplotlib.backends.backend_agg").FigureCanvasAgg(figure)
    figure.suptitle(title, x=0.012, ha="left", fontsize=13, color=theme.INK, weight="bold")
    grid = figure.subplots(rows, columns, sharex=True, squeeze=False, height_ratios=heights)
    axes = grid.ravel().tolist()
    for axis in axes:
        axis.set_facecolor(theme.PANEL)
        axis.set_axisbelow(True)
        axis.grid(color=theme.RULE, lw=0.7)
        axis.tick_params(colors=theme.MUTED, labelsize=9, length=0, which="both")
        for spine in axis.spines.values():
            spine.set_visible(False)
    return figure, axes


def name_below(axis: Axes, words: str) -> None:
    """What the horizontal axis counts, and its unit."""
    axis.set_xlabel(words, fontsize=9.5, color=theme.MUTED)


def save_sheet(figure: Figure, path: str | Path) -> Path:
    """Write the figure as PNG, replacing the file there; return the path."""
    file = io.BytesIO()
    figure.savefig(file, format="png")
    return write_whole(path, file.getvalue())
