"""The fronts as a picture: error against cost, a panel for each scene and batch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benchmarks.fronts import front_of, knee_of
from benchmarks.pictures import logarithmic, pyplot
from benchmarks.tradeoff.points import COSTS, Point, family, points_of, short

if TYPE_CHECKING:
    from pathlib import Path

FAMILIES = {
    "event_exact": ("#4b2e83", "D"),
    "rk4_split": ("#0b6e4f", "o"),
    "rk4": ("#c77700", "s"),
    "semi_implicit": ("#b03060", "^"),
    "euler": ("#5f6b76", "v"),
}
"""Colour and marker of the integrators."""


def draw(content: dict[str, Any], path: Path) -> None:
    """Write the PNG."""
    plt = pyplot()
    scenes = list(dict.fromkeys(row["scene"] for row in content["rows"]))
    figure, axes = plt.subplots(
        len(scenes),
        len(COSTS),
        figsize=(11, 3.3 * len(scenes)),
        squeeze=False,
        layout="constrained",
    )
    for line, scene in zip(axes, scenes, strict=True):
        for axis, batch in zip(line, COSTS, strict=True):
            points = points_of(content["rows"], scene, batch)
            axis.set_title(f"{scene}, {batch} environment{'s' if batch > 1 else ''}", loc="left")
            if front_of(points):
                _panel(axis, points)
            else:
                axis.set_axis_off()
                axis.text(0.0, 0.9, "nothing measured within 0.1 rad/s", transform=axis.transAxes)
    _legend(figure)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _panel(axis, points: list[Point]) -> None:
    along = front_of(points)
    for point in points:
        colour, marker = FAMILIES[family(point.integrator)]
        single = point.dtype == "float32"
        axis.plot(
            point.cost,
            max(point.error, 1e-14),
            marker,
            color=colour,
            markerfacecolor="white" if single else colour,
            markersize=5,
            alpha=1.0 if point in along else 0.45,
        )
    axis.plot(
        [p.cost for p in along],
        [max(p.error, 1e-14) for p in along],
        color="black",
        linewidth=0.8,
        drawstyle="steps-post",
        zorder=0,
    )
    chosen = knee_of(points)
    axis.plot(chosen.cost, chosen.error, "o", markersize=13, mfc="none", mec="#d00000", mew=1.4)
    for point in {along[0]: None, chosen: None, along[-1]: None}:
        label = axis.annotate(
            ("knee: " if point is chosen else "") + short(point).replace(", ", "\n", 1),
            (point.cost, max(point.error, 1e-14)),
            xytext=(8, 4),
            textcoords="offset points",
            fontsize=7.5,
            color="#d00000" if point is chosen else "black",
        )
        label.set_in_layout(False)
    _scales(axis, points)


def _scales(axis, points: list[Point]) -> None:
    """Logarithmic, with room on the right and above for the labels; nothing wilder than 1 rad/s."""
    logarithmic(axis, "time for a simulated second of an environment [s]", "error [rad/s]")
    costs = [point.cost for point in points]
    errors = [max(point.error, 1e-14) for point in points]
    axis.set_xlim(min(costs) / 1.5, max(costs) * 8)
    axis.set_ylim(min(errors) / 4, min(max(errors), 1.0) * 6)


def _legend(figure) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], linestyle="", marker=marker, color=colour, label=name)
        for name, (colour, marker) in FAMILIES.items()
    ]
    handles += [
        Line2D([], [], linestyle="", marker="o", color="black", label="filled: float64"),
        Line2D([], [], linestyle="", marker="o", mfc="white", color="black", label="open: float32"),
        Line2D([], [], color="black", linewidth=0.8, label="front"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=4, fontsize=8, frameon=False)
