"""The fronts as a picture: error against cost, a panel for each kind of floor and batch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benchmarks.points import front_of, knee_of
from benchmarks.report import pyplot
from benchmarks.tradeoff.points import COSTS, family, promises_of, short
from benchmarks.tradeoff.population import FLOORS, ROBOTS

if TYPE_CHECKING:
    from pathlib import Path

MARKERS = {"event_exact": "D", "rk4_split": "o"}
COLOURS = {"float32": "#0b6e4f", "float64": "#4b2e83"}


def draw(content: dict[str, Any], path: Path) -> None:
    """Write the PNG: bars from what half of the default robot's walks keep to what 99 % keep."""
    plt = pyplot()
    size = (11, 3.4 * len(FLOORS))
    figure, axes = plt.subplots(len(FLOORS), len(COSTS), figsize=size, layout="constrained")
    for line, floor in zip(axes, FLOORS, strict=True):
        for axis, batch in zip(line, COSTS, strict=True):
            points = promises_of(content, floor, ROBOTS[0], batch)
            title = f"{floor}, {batch} environment{'s' if batch > 1 else ''}"
            along = front_of(points)
            for p in points:
                look = {"color": COLOURS[p.dtype], "alpha": 1.0 if p in along else 0.4}
                axis.plot([p.cost] * 2, [p.typical, min(p.bounds["0.99"][0], 10.0)], lw=1, **look)
                label = f"{family(p.integrator)}, {p.dtype}"
                axis.plot(p.cost, p.error, MARKERS[family(p.integrator)], ms=5, label=label, **look)
            if along:
                ends = [p.cost for p in along], [p.error for p in along]
                axis.plot(*ends, color="black", lw=0.8, drawstyle="steps-post", zorder=0)
                title += f"\nknee: {short(knee_of(points))}"
            axis.set_title(title, loc="left", fontsize=9)
            axis.set(xscale="log", yscale="log", ylabel="error [rad/s]", ylim=(None, 3.0))
            axis.set_xlabel("time for a simulated second of an environment [s]")
    handles, names = axes[0, 0].get_legend_handles_labels()
    shown = dict(zip(names, handles, strict=True))
    figure.legend(shown.values(), shown.keys(), loc="outside upper center", ncols=4, fontsize=8)
    figure.savefig(path, dpi=110)
    plt.close(figure)
