"""Learning curves at equal time above, first-order gradients against differences below."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.pictures import pyplot
from benchmarks.short_horizon.slopes import HORIZONS
from benchmarks.short_horizon.tables import NAMES, compared, scores

if TYPE_CHECKING:
    from pathlib import Path

COLOURS = {"ppo": "#0b6e4f", "shac": "#7a3b9a", "sac": "#b5521a"}
FLOORS = ("#0b6e4f", "#b5521a", "#c79a00", "#7a3b9a", "#2b6cb0")


def draw(content: dict[str, Any], path: Path) -> None:
    """Write the PNG."""
    plt = pyplot()
    figure, axes = plt.subplots(2, 3, figsize=(11, 6), layout="constrained")
    for axis in axes[0, len(content.get("curves", {})) :]:
        axis.set_axis_off()
    for axis, (name, entries) in zip(axes[0], content.get("curves", {}).items(), strict=False):
        _curves(axis, name, entries)
    axes[0, 0].set_ylabel("score")
    panels = (
        ("all", "cosine", "cosine to the differences, all walks"),
        ("upright", "length", "length in theirs, walks without a fall"),
        ("all", "spread", "spread of single walks, in lengths of the gradient"),
    )
    for axis, (which, entry, title) in zip(axes[1], panels, strict=True):
        for colour, name in zip(FLOORS, content.get("slopes", {}), strict=False):
            rows = compared(content["slopes"], name, which)
            values = [getattr(row, entry) for row in rows]
            axis.plot(HORIZONS, values, "o-", color=colour, markersize=3, linewidth=1.2, label=name)
        _steps(axis, title)
    axes[1, 0].axhline(0, color="black", linewidth=0.5)
    axes[1, 0].set_ylim(-1.05, 1.05)
    axes[1, 1].set_ylim(0.75, 1.1)
    axes[1, 2].set_yscale("log")
    axes[1, 0].legend(fontsize=7, frameon=False)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def _curves(axis: Any, name: str, entries: dict[str, Any]) -> None:
    for algorithm, entry in entries.items():
        found, seconds = scores(entry, name), np.mean(entry["seconds"], axis=0)
        colour = COLOURS[algorithm]
        for row in found:
            axis.plot(seconds, row, color=colour, linewidth=0.5, alpha=0.4)
        axis.plot(seconds, found.mean(0), color=colour, linewidth=1.8, label=NAMES[algorithm])
    axis.set_title(name, loc="left", fontsize=9)
    axis.set_xlabel("seconds of learning", fontsize=8)
    axis.set_xlim(left=0)
    axis.set_ylim(-0.5, 1.2)
    axis.legend(fontsize=7, frameon=False, loc="upper left")


def _steps(axis: Any, title: str) -> None:
    axis.set_xscale("log", base=2)
    axis.set_xticks(HORIZONS, [f"{horizon}" for horizon in HORIZONS])
    axis.set_xlabel("steps of 0.02 s", fontsize=8)
    axis.set_title(title, loc="left", fontsize=8.5)
    axis.tick_params(labelsize=7)
