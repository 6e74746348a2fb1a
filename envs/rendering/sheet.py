"""Sheets of matplotlib panels in one style, without a display. Needs the extra `viz`."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

LEVEL: dict[str, Any] = {"color": theme.MUTED, "lw": 0.9, "ls": (0, (4, 3)), "zorder": 1}
"""Limits and other dashed lines."""


def make_sheet(
    rows: int,
    columns: int,
    size: tuple[float, float],
    title: str = "",
    heights: Sequence[float] | None = None,
    sharex: bool = True,
) -> tuple[Figure, list[Axes]]:
    """A figure of `size` [inches] with a title, and its rows * columns axes.

    heights: relative ones of the rows; None: all the same.
    """
    figure = require("matplotlib.figure").Figure(
        figsize=size, dpi=110, facecolor=theme.PAGE, layout="constrained"
    )
    require("matplotlib.backends.backend_agg").FigureCanvasAgg(figure)
    if title:
        _set_title(figure, title)
    grid = figure.subplots(rows, columns, sharex=sharex, squeeze=False, height_ratios=heights)
    axes = grid.ravel().tolist()
    for axis in axes:
        axis.set_facecolor(theme.PANEL)
        axis.set_axisbelow(True)
        axis.grid(color=theme.RULE, lw=0.7)
        axis.tick_params(colors=theme.MUTED, labelsize=9, length=0, which="both")
        for spine in axis.spines.values():
            spine.set_visible(False)
    return figure, axes


def name_panel(axis: Axes, label: str, note: str = "", below: str = "") -> None:
    """Label a panel: quantity and unit above, a note beside it, the x axis below."""
    axis.set_title(label, loc="left", fontsize=10, color=theme.INK, pad=4)
    axis.set_title(note, loc="right", fontsize=8.5, color=theme.MUTED, pad=4)
    if below:
        name_below(axis, below)


def name_below(axis: Axes, words: str) -> None:
    """Label the horizontal axis with quantity and unit."""
    axis.set_xlabel(words, fontsize=9.5, color=theme.MUTED)


def legend(axis: Axes, **options: Any) -> None:
    """A legend outside the panel, on the right."""
    place = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.02), "handlelength": 1.6}
    axis.legend(**{"frameon": False, "fontsize": 8.5, "labelcolor": theme.INK, **place, **options})


def shades(count: int) -> list[tuple[float, float, float, float]]:
    """Colours from light to dark that stay apart in grey, for a parameter that grows."""
    scale = require("matplotlib").colormaps["viridis"]
    return [scale(0.86 * (1 - i / max(count - 1, 1))) for i in range(count)]


def family(axis: Axes, x: ArrayLike, curves: Iterable[tuple[str, ArrayLike]]) -> None:
    """Curves of a growing parameter with a legend."""
    curves = list(curves)
    for (label, values), colour in zip(curves, shades(len(curves)), strict=True):
        axis.plot(x, values, color=colour, label=label, lw=1.4)
    legend(axis)


def png(figure: Figure, title: str = "") -> bytes:
    """The figure as a PNG file, with a title."""
    if title:
        _set_title(figure, title)
    file = io.BytesIO()
    figure.savefig(file, format="png")
    return file.getvalue()


def save_sheet(figure: Figure, path: str | Path) -> Path:
    """Write the figure as PNG atomically, replacing the file there; return the path."""
    return write_whole(path, png(figure))


def _set_title(figure: Figure, title: str) -> None:
    figure.suptitle(title, x=0.012, ha="left", fontsize=13, color=theme.INK, weight="bold")
