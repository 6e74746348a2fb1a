"""The fronts as a picture: error against cost, a panel for each kind of floor and batch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benchmarks.points import front_of, knee_of
from benchmarks.report import pyplot
from benchmarks.tradeoff.points import COSTS, UNBOUNDED, Promise, family, promises_of, short
from benchmarks.tradeoff.population import FLOORS, ROBOTS

if TYPE_CHECKING:
    from pathlib import Path

FAMILIES = {"event_exact": ("#4b2e83", "D"), "rk4_split": ("#0b6e4f", "o")}
"""Colour and marker of the integrators."""


def draw(content: dict[str, Any], path: Path) -> None:
    """Write the PNG: what is promised of the default robot, above what half of its walks keep."""
    plt = pyplot()
    figure, axes = plt.subplots(
        len(FLOORS), len(COSTS), figsize=(11, 3.6 * len(FLOORS)), layout="constrained"
    )
    for line, floor in zip(axes, FLOORS, strict=True):
        for axis, batch in zip(line, COSTS, strict=True):
            points = promises_of(content, floor, ROBOTS[0], batch)
            axis.set_title(f"{floor}, {batch} environment{'s' if batch > 1 else ''}", loc="left")
            if front_of(points):
                _panel(axis, points)
            else:
                axis.set_axis_off()
                axis.text(0.0, 0.9, "nothing promised within 0.1 rad/s", transform=axis.transAxes)
    _legend(figure)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _panel(axis, points: list[Promise]) -> None:
    along, knee = front_of(points), knee_of(points)
    for point in points:
        _mark(axis, point, point in along)
    costs, errors = [p.cost for p in along], [p.error for p in along]
    axis.plot(costs, errors, color="black", linewidth=0.8, drawstyle="steps-post", zorder=0)
    axis.plot(knee.cost, knee.error, "o", markersize=13, mfc="none", mec="#d00000", mew=1.4)
    axis.annotate(
        "knee: " + short(knee).replace(", ", "\n", 1),
        (knee.cost, knee.error),
        xytext=(8, 4),
        textcoords="offset points",
        fontsize=7.5,
        color="#d00000",
    ).set_in_layout(False)
    axis.set(xscale="log", yscale="log", ylabel="error [rad/s]")
    axis.set_xlabel("time for a simulated second of an environment [s]")
    axis.set_ylim(min(point.typical for point in points) / 4, 3.0)


def _mark(axis, point: Promise, ahead: bool) -> None:
    """Half of the walks below the bar's foot, 95 % below the marker, 99 % below its top."""
    colour, marker = FAMILIES[family(point.integrator)]
    shown = {"color": colour, "alpha": 1.0 if ahead else 0.45}
    top = min(point.bounds["0.99"][0], 10.0)
    axis.plot([point.cost] * 2, [point.typical, top], "-", linewidth=1.0, zorder=1, **shown)
    axis.plot(point.cost, point.typical, "_", markersize=7, **shown)
    if point.error < UNBOUNDED:
        face = "white" if point.dtype == "float32" else colour
        axis.plot(point.cost, point.error, marker, markerfacecolor=face, markersize=5, **shown)


def _legend(figure) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], linestyle="", marker=marker, color=colour, label=name)
        for name, (colour, marker) in FAMILIES.items()
    ]
    handles += [
        Line2D([], [], linestyle="", marker="o", color="black", label="filled: float64"),
        Line2D([], [], linestyle="", marker="o", mfc="white", color="black", label="open: float32"),
        Line2D([], [], color="black", marker="_", markersize=7, label="50 to 99 % of the walks"),
        Line2D([], [], color="black", linewidth=0.8, label="front of what 95 % keep"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=4, fontsize=8, frameon=False)
