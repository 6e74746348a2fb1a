"""The course of a training run as a PNG. Needs the extra `viz` (or `train`, which holds it)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from stickslip.agents.pictures.sheet import make_sheet, name_below, save_sheet
from stickslip.agents.training.log import read_columns
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from stickslip.agents.training.configuration import Configuration

LIMITS = ("low", "high")
COLUMNS = 3
TRAINING, TEST = "#8FA3B5", "#D55E00"


Curves: TypeAlias = dict[str, list[float]]
"""A run's table by columns."""


class Panel(NamedTuple):
    """What is drawn where: columns of metrics.csv and evaluations.csv (None for neither)."""

    title: str
    training: str | None
    test: str | None
    share: float = 1.0
    """Unit of the column in that of the panel."""
    log: bool = False


SCORE = Panel("score (0: doing nothing, 1: best known)", None, "task_score")
"""Of a run on a named task."""


def plot_panels(
    directory: str | Path,
    config: Configuration,
    panels: Sequence[Panel],
    machine: str,
    add: Callable[[list[Axes]], None] = lambda axes: None,
) -> Path:
    """Write learning.png into a run's directory from its metrics and evaluations; return its path.

    add: draws more on the axes, one for each panel.
    """
    directory = Path(directory)
    metrics = read_columns(directory / "metrics.csv")
    tests = read_columns(directory / "evaluations.csv")
    seconds = (metrics.get("seconds") or [0.0])[-1]
    steps = int((metrics.get("timesteps") or [0])[-1])
    name = config.algorithm.upper()
    where = f"the {machine}" if config.task is None else config.task
    title = f"{name} on {where}: {seconds:.0f} s of training, evaluations aside"
    if steps < config.timesteps:
        title += f", unfinished: {steps:,} of {config.timesteps:,} steps"
    rows = -(-len(panels) // COLUMNS)
    figure, axes = make_sheet(rows, COLUMNS, (12, 3.1 * rows), title)
    for axis in axes[len(panels) :]:
        axis.set_visible(False)
    axes = axes[: len(panels)]
    unit, scale = _unit(config.timesteps)
    for axis, panel in zip(axes, panels, strict=True):
        _draw(axis, panel, metrics, tests, scale)
    add(axes)
    for axis in axes[-COLUMNS:]:
        name_below(axis, f"control steps [{unit}]")
    _explain(figure)
    return save_sheet(figure, directory / "learning.png")


def _draw(axis: Axes, panel: Panel, metrics: Curves, tests: Curves, scale: float) -> None:
    axis.set_title(panel.title, loc="left", fontsize=10, color=theme.INK, pad=4)
    if panel.log:
        axis.set_yscale("log")
    for table, column, colour, width in (
        (metrics, panel.training, TRAINING, 1.0),
        (tests, panel.test, TEST, 1.7),
    ):
        if column is None or not table.get(column):
            continue
        steps = np.asarray(table["timesteps"]) / scale
        values = panel.share * np.asarray(table[column])
        if panel.log:
            values = np.where(values > 0, values, np.nan)
        marker = "o" if len(steps) < 3 else None
        axis.plot(steps, values, color=colour, lw=width, marker=marker, ms=4)
        if table is tests and f"{column}_low" in table:
            low, high = (panel.share * np.asarray(table[f"{column}_{end}"]) for end in LIMITS)
            if len(steps) == 1:  # where a band has no width
                axis.vlines(steps, low, high, color=colour, lw=1.0)
            else:
                axis.fill_between(steps, low, high, color=colour, alpha=0.18, lw=0)


def _explain(figure: Figure) -> None:
    """What the colours stand for."""
    lines = require("matplotlib.lines")
    handles = [lines.Line2D([], [], color=TRAINING), lines.Line2D([], [], color=TEST, lw=1.7)]
    labels = [
        "training episodes, with exploration",
        "evaluation: whole episodes, without (band: 95 %)",
    ]
    # below: beside the title there is no room where a run is unfinished
    figure.legend(handles, labels, loc="outside lower right", ncols=2, frameon=False, fontsize=9.5)


def _unit(timesteps: int) -> tuple[str, float]:
    return ("millions", 1e6) if timesteps >= 500_000 else ("thousands", 1e3)
