"""The picture: rates, fronts of the trade, growth of dp and the methods' gaps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.fronts import front_of, knee_of
from benchmarks.pictures import logarithmic, pyplot
from benchmarks.ugv.methods import RUNS
from benchmarks.ugv.points import Point, points_of, reliable, short
from benchmarks.ugv.trade import BATCHES

if TYPE_CHECKING:
    from pathlib import Path

COLOURS = {"exact": "#0b6e4f", "quintic": "#4b2e83", "cubic": "#c77700", "pchip": "#b03060",
           "makima": "#2a6fbb", "linear": "#5f6b76"}  # fmt: skip
NAMES = {"exact": "closed form"}
LEAST = 1e-6
"""Gaps below are drawn here."""


def draw(content: dict[str, Any], path: Path) -> None:
    """Write the PNG, with a panel for whatever has been measured."""
    plt = pyplot()
    figure, axes = plt.subplots(2, 2, figsize=(12, 9), layout="constrained")
    for axis, track in zip(axes[0], ("bump", "rough"), strict=True):
        axis.set_title(f"{track}, {BATCHES[-1]} poses at once", loc="left")
        _front(axis, points_of(content.get("trade", []), track, BATCHES[-1]))
    figure.legend(handles=_handles(), loc="outside upper center", ncols=5, fontsize=8,
                  frameon=False)  # fmt: skip
    _growth(axes[1, 0], content.get("growth", []))
    _gaps(axes[1, 1], content.get("methods", []))
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _front(axis, points: list[Point]) -> None:
    if not points:
        return
    good = reliable(points)
    along = front_of(good)
    for point in points:
        colour = COLOURS[point.interpolation]
        axis.plot(
            point.cost,
            point.error,
            "s" if point.checked else "o",
            color=colour,
            markerfacecolor="white" if point.dtype == "float32" else colour,
            markersize=5,
            alpha=1.0 if point in along else 0.5,
        )
    heights = [p.error for p in along]
    axis.plot([p.cost for p in along], heights, "k", lw=0.8, drawstyle="steps-post", zorder=0)
    chosen = knee_of(good)
    axis.plot(chosen.cost, chosen.error, "o", ms=13, mfc="none", mec="#d00000")
    half = (min(p.cost for p in points) * max(p.cost for p in points)) ** 0.5
    places = {along[0]: (9, 22), along[-1]: (6, -22), chosen: (12, -24)}
    for point, (right, up) in places.items():
        leftwards = point.cost > half
        axis.annotate(
            ("knee: " if point is chosen else "") + short(point),
            (point.cost, point.error),
            xytext=(-right if leftwards else right, up),
            textcoords="offset points",
            ha="right" if leftwards else "left",
            fontsize=7.5,
            color="#d00000" if point is chosen else "black",
        )
    _log(axis, "processor time of a pose and its equilibrium [s]", "error [-]")


def _handles() -> list:
    from matplotlib.lines import Line2D

    def mark(colour, label, marker="o", face=None):
        return Line2D([], [], ls="", marker=marker, color=colour, mfc=face or colour, label=label)

    found = [mark(colour, NAMES.get(name, name)) for name, colour in COLOURS.items()]
    found += [mark("black", "open: float32", face="white"), mark("black", "unchecked")]
    return [*found, mark("black", "checked: hollow ground, clearance", marker="s")]


def _growth(axis, rows: list[dict[str, Any]]) -> None:
    """Seconds of dp's two parts against the grid."""
    chosen = [row for row in rows if row["varied"] == "angles"]
    if not chosen:
        return
    waypoints = chosen[0]["waypoints"]
    axis.set_title(f"dynamic programming, {waypoints} waypoints", loc="left")
    for part, colour in (("stations", "#0b6e4f"), ("recursion", "#4b2e83")):
        axis.plot([row["angles"] for row in chosen], [row[part] for row in chosen], "o-",
                  color=colour, label=part)  # fmt: skip
    axis.legend(fontsize=8)
    _log(axis, "angles of each leg", "processor time [s]")
    ticks = [row["angles"] for row in chosen]
    axis.set_xticks(ticks, [str(n) for n in ticks])


def _gaps(axis, rows: list[dict[str, Any]]) -> None:
    """Relative distance from the best known value against time, each method's median large."""
    axis.set_title("methods on twelve tracks: feasible results", loc="left")
    colours = list(COLOURS.values())
    for name, colour in zip(RUNS, colours, strict=True):
        of = [row for row in rows if row["method"] == name and row["gap"] is not None]
        if not of:
            continue
        seconds, gaps = ([max(row[key], LEAST) for row in of] for key in ("seconds", "gap"))
        axis.plot(seconds, gaps, ".", color=colour, alpha=0.4)
        label = f"{name} ({len(of)})"
        axis.plot(np.median(seconds), np.median(gaps), "D", color=colour, ms=8, label=label)
    if rows:
        axis.legend(fontsize=7.5, ncols=3, loc="upper right")
    _log(axis, "time of one problem [s]", "gap to the best known, in parts of legs straight down")
    axis.set_ylim(LEAST / 3, 30)


def _log(axis, x: str, y: str) -> None:
    logarithmic(axis, x, y)
    axis.margins(x=0.12, y=0.16)
