"""How reports are drawn: one colour and dash for a method everywhere, panels by family."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from stickslip.agents.optimisers.results import Run

COLOURS = (
    "#0072B2", "#D55E00", "#008069", "#7B6A8D", "#E69F00", "#56B4E9", "#CC79A7", "#111111",
)  # fmt: skip
DASHES = ("-", (0, (4, 1.5)), (0, (1, 1.2)))
MARKERS = "os^Dv<>Ph*Xp"
LETTER = 0.115
"""Width of a title's letter, about [inch]."""
IN_WORDS = {
    "posture": "leg angles of the UGV",
    "split": "torque split (convex)",
    "gait": "gaits (convex)",
    "shooting": "torques through the simulator",
    "gains": "feedback gains (noisy)",
    "design": "designs",
    "goals": "two goals",
}
"""Families, as panels are titled."""


class Style(NamedTuple):
    """Of a method's line."""

    colour: str
    dash: str | tuple[int, tuple[float, ...]]
    marker: str


def styles(runs: Iterable[Run]) -> dict[str, Style]:
    """One for each method, in the order of the runs."""
    names = list(dict.fromkeys(run.method for run in runs))
    return {
        name: Style(
            COLOURS[i % len(COLOURS)],
            DASHES[i // len(COLOURS) % len(DASHES)],
            MARKERS[i % len(MARKERS)],
        )
        for i, name in enumerate(names)
    }


def panels(
    count: int, title: str, columns: int = 3, width: float = 3.7, height: float = 0.0
) -> tuple[Figure, list[Axes]]:
    """A figure with so many panels, and room for the legend at the right."""
    columns = min(columns, count)
    rows = -(-count // columns)
    figure = require("matplotlib.figure").Figure(
        figsize=(max(width * columns + 1.9, LETTER * len(title)), 0.5 + max(2.75 * rows, height)),
        dpi=100,
        facecolor=theme.PAGE,
        layout="constrained",
    )
    require("matplotlib.backends.backend_agg").FigureCanvasAgg(figure)
    figure.suptitle(title, x=0.012, ha="left", fontsize=12, color=theme.INK, weight="bold")
    axes = figure.subplots(rows, columns, squeeze=False).ravel().tolist()
    for axis in axes[count:]:
        axis.set_axis_off()
    for axis in axes[:count]:
        axis.set_facecolor(theme.PANEL)
        axis.set_axisbelow(True)
        axis.grid(color=theme.RULE, lw=0.7)
        axis.tick_params(colors=theme.MUTED, labelsize=8, length=0, which="both")
        for spine in axis.spines.values():
            spine.set_visible(False)
    return figure, axes[:count]


def titled(axis: Axes, title: str, below: str = "", beside: str = "") -> None:
    """A panel's title and what its axes count."""
    axis.set_title(title, loc="left", fontsize=9.5, color=theme.INK)
    axis.set_xlabel(below, fontsize=8.5, color=theme.MUTED)
    axis.set_ylabel(beside, fontsize=8.5, color=theme.MUTED)


def legend(
    figure: Figure, all_styles: dict[str, Style], names: Sequence[str], line: bool = True
) -> None:
    """The methods' names, at the right."""
    lines = require("matplotlib.lines")
    handles = [
        lines.Line2D(
            [], [], color=all_styles[name].colour, linestyle=all_styles[name].dash if line else "",
            marker="" if line else all_styles[name].marker, markersize=5, label=name,
        )
        for name in names
    ]  # fmt: skip
    figure.legend(handles=handles, loc="outside right center", fontsize=8.5, frameon=False)
