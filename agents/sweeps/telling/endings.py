"""How a sweep's episodes fail, as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.pictures.sheet import save_sheet
from stickslip.agents.shown_names import shown_name
from stickslip.agents.sweeps.playing.play import ENDINGS, FINE
from stickslip.agents.sweeps.telling.scales import edges, logarithmic
from stickslip.agents.sweeps.telling.views import (
    COLOURS,
    MOST_POLICIES,
    View,
    averaged,
    coloured,
    labels,
    scales,
    sheet,
)
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

    from stickslip.agents.sweeps.reading import SweepArrays

GOES_ON = "#E4E9ED"
BAR = 0.8
"""Width of a bar, in parts of what a value has between its neighbours."""


def draw_endings(found: SweepArrays, at: int, task: str, view: View, path: Path) -> Path:
    """Which ending is the most frequent of those that are failures, where half of the episodes
    fail; along one axis the shares of all."""
    names = [n for n in ENDINGS if n not in FINE and n in found.arrays and found[n][at].any()]
    places = tuple(1 + found.dims[2:].index(dim) for dim in view.over)
    total = found["episodes"][at].sum(axis=places) if places else found["episodes"][at]
    shares = np.stack([found[n][at].sum(axis=places) / total for n in names])
    policies = found.coordinates["policy"][:MOST_POLICIES]
    title = f"{task}: how it ends{averaged(view)}"
    figure, axes = sheet(1, len(policies), (max(5.5, 1.2 + 3.9 * len(policies)), 3.9), title)
    for which, policy in enumerate(policies):
        axis = axes[0][which]
        if len(view.names) == 1:
            _stack(axis, found, view, shares[:, which])
        else:
            _failures(axis, found, view, shares[:, which])
        axis.set_title(shown_name(str(policy)), loc="left", fontsize=10, color=theme.INK)
        labels(axis, found, view, True, which == 0 and len(view.names) > 1)
    patches = require("matplotlib.patches")
    shown = [(GOES_ON, "less than half fail" if len(view.names) > 1 else "goes on to its end")]
    shown += [(COLOURS[i % len(COLOURS)], n.replace("_", " ")) for i, n in enumerate(names)]
    handles = [patches.Patch(color=colour, label=label) for colour, label in shown]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    return save_sheet(figure, path)


def _failures(axis: Axes, found: SweepArrays, view: View, shares: np.ndarray) -> None:
    most = np.where(shares.sum(axis=0) >= 0.5, 1 + np.argmax(shares, axis=0), 0)
    colours = [GOES_ON, *(COLOURS[i % len(COLOURS)] for i in range(len(shares)))]
    listed = require("matplotlib.colors").ListedColormap(colours)
    high = len(colours) - 0.5
    coloured(axis, found, view, most, listed, (-0.5, high))
    scales(axis, found, view)


def _stack(axis: Axes, found: SweepArrays, view: View, shares: np.ndarray) -> None:
    """A bar at every value that was played, of samples from the middle to the next one."""
    x = found.coordinates[view.names[0]]
    order = np.argsort(x)
    low, high = _bars(x[order], view.scattered)
    rest = 1 - shares.sum(axis=0)
    base = np.zeros(len(x))
    for place, share in enumerate((*shares, rest)):
        colour = GOES_ON if place == len(shares) else COLOURS[place % len(COLOURS)]
        height = 100 * share[order]
        axis.bar(low, height, high - low, base, align="edge", color=colour, lw=0)
        base = base + height
    axis.set_ylim(0, 100)
    axis.set_ylabel("episodes [%]", fontsize=9, color=theme.MUTED)
    scales(axis, found, view)


def _bars(values: np.ndarray, side_by_side: bool) -> tuple[np.ndarray, np.ndarray]:
    """From where to where the bars of values that rise go; none beyond half a cell."""
    borders = edges(values)
    if side_by_side:
        borders = np.clip(borders, values[0], values[-1])
        return borders[:-1], borders[1:]
    log = logarithmic(values)
    middle, borders = (np.log(values), np.log(borders)) if log else (values, borders)
    half = BAR * np.minimum(middle - borders[:-1], borders[1:] - middle)
    low, high = middle - half, middle + half
    return (np.exp(low), np.exp(high)) if log else (low, high)


def has_endings(found: SweepArrays, at: int) -> bool:
    """Whether an episode of a task failed."""
    return any(n in found.arrays and found[n][at].any() for n in ENDINGS if n not in FINE)
