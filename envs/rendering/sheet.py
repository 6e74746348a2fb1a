"""Sheets of matplotlib panels in one style, without a display. Needs the extra `viz`."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from stickslip.dynamics.lazily import require
from stickslip.envs.rendering import theme
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

P = ParamSpec("P")
T = TypeVar("T")

WIDTH = 7.6
"""Width of a sheet that a page shows across its text [inches]."""
STYLE: dict[str, Any] = {
    "axes.axisbelow": True,
    "axes.facecolor": theme.PANEL,
    "axes.grid": True,
    "axes.labelcolor": theme.MUTED,
    "axes.labelsize": 9.5,
    "axes.prop_cycle": f"cycler('color', {[one.lstrip('#') for one in theme.PLAYERS]})",
    **{f"axes.spines.{side}": False for side in ("left", "right", "top", "bottom")},
    "axes.titlecolor": theme.INK,
    "axes.titlelocation": "left",
    "axes.titlepad": 4,
    "axes.titlesize": 10,
    "figure.constrained_layout.h_pad": 0.06,
    "figure.constrained_layout.w_pad": 0.06,
    "figure.dpi": 140,
    "figure.facecolor": theme.PAGE,
    "figure.titlesize": 12,
    "figure.titleweight": "bold",
    "grid.color": theme.RULE,
    "grid.linewidth": 0.7,
    "legend.borderaxespad": 0.4,
    "legend.edgecolor": "none",
    "legend.facecolor": theme.PANEL,
    "legend.fontsize": 8.5,
    "legend.framealpha": 0.85,
    "legend.handlelength": 1.6,
    "legend.labelcolor": theme.INK,
    "legend.title_fontsize": 8.5,
    "lines.linewidth": 1.4,
    "lines.markersize": 5,
    "savefig.dpi": "figure",
    "text.color": theme.INK,
    **{f"{axis}tick.color": theme.MUTED for axis in "xy"},
    **{f"{axis}tick.labelsize": 9 for axis in "xy"},
    **{f"{axis}tick.{which}.size": 0 for axis in "xy" for which in ("major", "minor")},
}
"""matplotlib's settings for every plot of the package, the benchmarks and the documentation."""
LEVEL: dict[str, Any] = {"color": theme.MUTED, "lw": 0.9, "ls": (0, (4, 3)), "zorder": 1}
"""Limits and other dashed lines."""
TITLE: dict[str, Any] = {"x": 0.012, "ha": "left"}


def styled(draw: Callable[P, T]) -> Callable[P, T]:
    """Decorate a function to draw in STYLE, whatever the user's settings of matplotlib.

    The functions below are for use inside such a one.
    """

    @wraps(draw)
    def drawn(*args: P.args, **options: P.kwargs) -> T:
        with require("matplotlib.style").context(["default", STYLE]):
            return draw(*args, **options)

    return drawn


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
    figure = require("matplotlib.figure").Figure(figsize=size, layout="constrained")
    require("matplotlib.backends.backend_agg").FigureCanvasAgg(figure)
    if title:
        figure.suptitle(title, **TITLE)
    grid = figure.subplots(rows, columns, sharex=sharex, squeeze=False, height_ratios=heights)
    return figure, grid.ravel().tolist()


def name_panel(axis: Axes, label: str, note: str = "", below: str = "") -> None:
    """Label a panel: quantity and unit above, a note beside it, the x axis below."""
    axis.set_title(label)
    axis.set_title(note, loc="right", fontsize=8.5, color=theme.MUTED)
    if below:
        axis.set_xlabel(below)


def shades(count: int) -> list[tuple[float, float, float, float]]:
    """Colours from light to dark that stay apart in grey, for a parameter that grows."""
    scale = require("matplotlib").colormaps["viridis"]
    return [scale(0.82 * (1 - i / max(count - 1, 1))) for i in range(count)]


def family(
    axis: Axes, x: ArrayLike, curves: Sequence[tuple[str, ArrayLike]], **options: Any
) -> None:
    """Curves of a growing parameter with a legend; options: of the legend."""
    for (label, values), colour in zip(curves, shades(len(curves)), strict=True):
        axis.plot(x, values, color=colour, label=label)
    axis.legend(**options)


@styled
def png(figure: Figure, title: str = "") -> bytes:
    """The figure as a PNG file, with a title."""
    if title:
        figure.suptitle(title, **TITLE)
    file = io.BytesIO()
    figure.savefig(file, format="png")
    return file.getvalue()


def save_sheet(figure: Figure, path: str | Path) -> Path:
    """Write the figure as PNG atomically, replacing the file there; return the path."""
    return write_whole(path, png(figure))
