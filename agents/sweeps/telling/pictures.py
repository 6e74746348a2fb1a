"""Pictures of a sweep: maps and lines of what policies earn, and how they fail."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.pictures.sheet import save_sheet
from stickslip.agents.shown_names import shown_name
from stickslip.agents.sweeps.telling.endings import draw_endings, has_endings
from stickslip.agents.sweeps.telling.scales import Colours, colours_of
from stickslip.agents.sweeps.telling.told import Told
from stickslip.agents.sweeps.telling.views import (
    COLOURS,
    MOST_POLICIES,
    View,
    averaged,
    coloured,
    labels,
    scales,
    sheet,
    view_of,
)
from stickslip.agents.sweeps.telling.words import APART, SLIPS, draws, error_of, measured
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.ticker import Formatter

    from stickslip.agents.sweeps.reading import SweepArrays

BAND = "95 % interval of the mean"
ALONE = 6.4
"""Width of the axes of lines, which stand alone [inches]."""


class Shown(NamedTuple):
    """A quantity [policies, ...]. half: of its interval, or None. calm: where no episode failed.
    share: whether it is one, of 100 %. less: whether less is better, and nothing below 0."""

    title: str
    values: np.ndarray
    half: np.ndarray | None
    calm: np.ndarray
    share: bool
    less: bool

    @property
    def least_span(self) -> float:
        """What its scale spans at least: 1 %, or what counts as sliding."""
        return (1.0 if self.share else SLIPS) if self.less else 0.0

    @property
    def colours(self) -> Colours:
        """The scale of its maps."""
        calm = np.ones_like(self.calm) if self.share else self.calm
        return colours_of(self.values, calm, 0.0 if self.less else None, self.least_span)


def write_pictures(found: SweepArrays, path: Path, told: Told) -> list[Path]:
    """sweep.png and, where episodes failed, endings.png of a sweep's summaries, for several tasks
    each with its number; the paths. Nothing is drawn where nothing varies."""
    view, written = view_of(found), []
    if view is None:
        return []
    for at, task in enumerate(found.coordinates["task"]):
        number = f"-{at + 1}" if len(found.coordinates["task"]) > 1 else ""
        written.append(_measures(found, at, task, view, told, path / f"sweep{number}.png"))
        if has_endings(found, at):
            written.append(draw_endings(found, at, task, view, path / f"endings{number}.png"))
    return written


def _measures(found: SweepArrays, at: int, task: str, view: View, told: Told, path: Path) -> Path:
    shown = _quantities(found, at, view, told)
    policies = found.coordinates["policy"][:MOST_POLICIES]
    columns = 1 if len(view.names) == 1 else len(policies)
    size = (max(5.5, 1.2 + 3.7 * columns) if columns > 1 else 7.5, 0.7 + 2.7 * len(shown))
    figure, axes = sheet(len(shown), columns, size, f"{task}{averaged(view)}")
    for row, one in enumerate(shown):
        if columns == 1 and len(view.names) == 1:
            _lines(axes[row][0], found, view, one, policies)
            continue
        colours, drawn = one.colours, None
        for column, policy in enumerate(policies):
            axis = axes[row][column]
            drawn = _map(axis, found, view, one.values[column], colours, one.less)
            if row == 0:
                axis.set_title(shown_name(str(policy)), loc="left", fontsize=10, color=theme.INK)
            labels(axis, found, view, row == len(shown) - 1, column == 0)
        if drawn is None:
            continue
        bar = figure.colorbar(
            drawn, ax=axes[row], fraction=0.05, pad=0.02, extend=colours.extend, format=_plain()
        )
        title = f"{one.title}\n{colours.words}" if colours.words else one.title
        bar.set_label(title, fontsize=9, color=theme.MUTED)
        bar.ax.tick_params(labelsize=8, colors=theme.MUTED)
    for column in range(columns):
        labels(axes[-1][column], found, view, True, column == 0 and len(view.names) > 1)
    return save_sheet(figure, path)


def _quantities(found: SweepArrays, at: int, view: View, told: Told) -> list[Shown]:
    """Return, failures and slip, averaged over what is not drawn."""
    places = tuple(1 + found.dims[2:].index(dim) for dim in view.over)

    def mean(values: np.ndarray) -> np.ndarray:
        known = np.isfinite(values)
        with np.errstate(invalid="ignore"):  # where nothing is known
            return np.where(known, values, 0.0).sum(axis=places) / known.sum(axis=places)

    count = found["episodes"][at]
    points = count.size / mean(count).size
    error, failed = error_of(found, at), mean(found["falls"][at] / count)
    halves = {}
    if np.isfinite(error).all() and draws(found, at) is not False:
        noise = np.sqrt(failed * (1 - failed) / (mean(count) * points))
        spread = np.sqrt(mean(error) / points)
        halves = {"mean return": APART * spread, told.failures: 100 * APART * noise}
    return [
        Shown(
            title if unit == "-" else f"{title} [{unit}]",
            mean(values),
            halves.get(title),
            failed == 0,
            unit == "%",
            title != "mean return",
        )
        for title, unit, values in measured(found, at, told)
    ]


def _plain() -> Formatter:
    """Numbers of a bar without a factor or a difference beside it."""
    made = require("matplotlib.ticker").ScalarFormatter(useOffset=False)
    made.set_scientific(False)
    return made


def _lines(axis: Axes, found: SweepArrays, view: View, one: Shown, policies: np.ndarray) -> None:
    x = found.coordinates[view.names[0]]
    order = np.argsort(x)
    halves = np.zeros_like(one.values) if one.half is None else np.nan_to_num(one.half)
    banded = not view.scattered and bool(np.any(halves > 0))
    for which, policy in enumerate(policies):
        colour, y = COLOURS[which], one.values[which][order]
        axis.plot(
            x[order],
            y,
            color=colour,
            lw=0 if view.scattered else 1.6,
            marker="o" if view.scattered or len(x) < 12 else None,
            ms=3.5,
            label=shown_name(str(policy)),
            clip_on=False,
        )
        if banded:
            half = halves[which][order]
            low, high = y - half, y + half
            if one.share:
                low, high = np.maximum(low, 0), np.minimum(high, 100)
            axis.fill_between(x[order], low, high, color=colour, alpha=0.18, lw=0)
    axis.set_ylabel(one.title, fontsize=9, color=theme.MUTED)
    axis.yaxis.set_major_formatter(_plain())
    if one.less:
        high = max(axis.get_ylim()[1], one.least_span)
        axis.set_ylim(0, min(high, 100) if one.share else high)
    if one.title.startswith("mean"):
        handles = axis.get_legend_handles_labels()[0]
        if banded:
            patch = require("matplotlib.patches").Patch
            handles.append(patch(color=theme.MUTED, alpha=0.25, lw=0, label=BAND))
        axis.legend(handles=handles, frameon=False, fontsize=8.5)
    scales(axis, found, view, ALONE)


def _map(
    axis: Axes,
    found: SweepArrays,
    view: View,
    values: np.ndarray,
    colours: Colours,
    less: bool,
) -> ScalarMappable:
    shown, ends = "magma_r" if less else "viridis", (colours.low, colours.high)
    drawn = coloured(axis, found, view, values, shown, ends)
    scales(axis, found, view)
    return drawn
