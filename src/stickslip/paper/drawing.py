"""Sheets of panels in the style of the package's other plots. Needs the extra `viz`."""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DASH = (0, (4, 3))


def sheet(
    rows: int = 1, columns: int = 1, *, height: float = 3.2, **options: Any
) -> tuple[Figure, np.ndarray]:
    """A figure and its axes [rows, columns]; `height` of a row [inches]; options of subplots."""
    figure = require("matplotlib.figure").Figure(
        figsize=(9.0, height * rows + 0.55), dpi=110, facecolor=theme.PAGE, layout="constrained"
    )
    require("matplotlib.backends.backend_agg").FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    for axis in axes.flat:
        axis.set_facecolor(theme.PANEL)
        axis.set_axisbelow(True)
        axis.grid(color=theme.RULE, lw=0.7)
        axis.tick_params(which="both", colors=theme.MUTED, labelsize=8.5, length=0)
        for spine in axis.spines.values():
            spine.set_visible(False)
    return figure, axes


def name_panel(axis: Axes, label: str, note: str = "", below: str = "") -> None:
    """Label a panel: quantity and unit above, a note beside it, the x axis below."""
    axis.set_title(label, loc="left", fontsize=9.5, color=theme.INK, pad=4)
    axis.set_title(note, loc="right", fontsize=8.5, color=theme.MUTED, pad=4)
    axis.set_xlabel(below, fontsize=9, color=theme.MUTED)


def shades(count: int) -> list[Any]:
    """Colours from light to dark that stay apart in grey, for a parameter that grows."""
    scale = require("matplotlib").colormaps["viridis"]
    return [scale(0.86 * (1 - i / max(count - 1, 1))) for i in range(count)]


def family(axis: Axes, x: Any, curves: Iterable[tuple[str, Any]], **look: Any) -> None:
    """Curves of a growing parameter with a legend."""
    curves = list(curves)
    for (label, values), colour in zip(curves, shades(len(curves)), strict=True):
        axis.plot(x, values, color=colour, label=label, **{"lw": 1.4, **look})
    legend(axis)


def legend(axis: Axes, **options: Any) -> None:
    """A legend outside the panel, on the right."""
    place = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.02), "handlelength": 1.6}
    axis.legend(**{"frameon": False, "fontsize": 8.5, "labelcolor": theme.INK, **place, **options})


def mark(axis: Axes, x: float | None = None, y: float | None = None) -> None:
    """A dashed line across the panel."""
    look: dict[str, Any] = {"color": theme.MUTED, "lw": 0.9, "ls": DASH, "zorder": 1}
    if x is not None:
        axis.axvline(x, **look)
    if y is not None:
        axis.axhline(y, **look)


def png(figure: Figure, title: str) -> bytes:
    """The figure with its title as a PNG file."""
    figure.suptitle(title, x=0.012, ha="left", fontsize=12, color=theme.INK, weight="bold")
    file = io.BytesIO()
    figure.savefig(file, format="png")
    return file.getvalue()
