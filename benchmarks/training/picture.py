"""Learning curves as a picture: score against processor time, a panel for each task."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.report import pyplot
from benchmarks.training.tables import GOAL, NAMES, scores
from stickslip.agents.evaluation.statistics import mean_interval
from stickslip.envs import TASKS

if TYPE_CHECKING:
    from pathlib import Path

COLOURS = {"jax": "#0b6e4f", "sb3": "#b5521a"}
COLUMNS = 3
LEAST = -0.25
"""Scores below are outside of the picture."""


def draw(content: dict[str, Any], path: Path) -> None:
    """Write the PNG: mean score of the seeds with its 95 % interval, and each seed faintly."""
    plt = pyplot()
    names = [name for name in TASKS if name in content["tasks"]]
    lines = -(-len(names) // COLUMNS)
    figure, axes = plt.subplots(
        lines, COLUMNS, figsize=(11, 2.5 * lines), layout="constrained", squeeze=False, sharey=True
    )
    for axis in axes.ravel()[len(names) :]:
        axis.set_axis_off()
    for axis, name in zip(axes.ravel(), names, strict=False):
        for trainer, entry in content["tasks"][name].items():
            _curve(axis, entry, name, trainer)
        axis.axhline(GOAL, color="black", linewidth=0.6, linestyle=":")
        axis.set_title(name, loc="left", fontsize=9)
        axis.set_xlim(left=0)
        axis.set_ylim(LEAST, 1.45)  # room for the names
        axis.legend(fontsize=7, loc="upper left", frameon=False)
    for axis in axes[:, 0]:
        axis.set_ylabel("score")
    for axis in axes[-1]:
        axis.set_xlabel("processor time of one training [s]")
    figure.savefig(path, dpi=100)
    plt.close(figure)


def _curve(axis: Any, entry: dict[str, Any], name: str, trainer: str) -> None:
    found, seconds = scores(entry, name), entry["processor_seconds"]
    means = [mean_interval(column) for column in found.T]
    colour = COLOURS[trainer]
    for row in found:
        axis.plot(seconds, row, color=colour, linewidth=0.5, alpha=0.35)
    label = f"{NAMES[trainer]}, {entry['steps'][-1] / 1e6:.2g} M steps"
    axis.plot(seconds, [one.value for one in means], color=colour, linewidth=1.6, label=label)
    low, high = (np.asarray([getattr(one, end) for one in means]) for end in ("low", "high"))
    axis.fill_between(seconds, low, high, color=colour, alpha=0.15, linewidth=0)
