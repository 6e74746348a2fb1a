"""Pictures of a sweep: maps and lines of what policies earn, and how they fail."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.pictures.sheet import save_sheet
from stickslip.agents.shown_names import shown_name
from stickslip.agents.sweeps.design import SAMPLE
from stickslip.agents.sweeps.playing.play import ENDINGS
from stickslip.agents.sweeps.telling.told import Told
from stickslip.agents.sweeps.telling.words import APART, measured
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

    from stickslip.agents.sweeps.reading import SweepArrays

COLOURS = ("#0072B2", "#D55E00", "#008069", "#7B6A8D", "#E69F00", "#56B4E9", "#CC79A7", "#5D6B79")
GOES_ON = "#E4E9ED"
FINE = ("ok", "slip_onset", "step_complete")
"""Endings that are none."""
MOST_POLICIES = 8


class View(NamedTuple):
    """What is drawn along which coordinates: one for lines, two for maps. scattered: of samples.
    over: dimensions, after task and policy, that are averaged."""

    names: tuple[str, ...]
    scattered: bool
    over: tuple[str, ...]


class Shown(NamedTuple):
    """A quantity [policies, ...] with half its interval, or None, and whether less is better."""

    title: str
    values: np.ndarray
    half: np.ndarray | None
    less: bool


def view_of(found: SweepArrays) -> View | None:
    """The two longest gridded axes, or the first two random ones; None where nothing varies."""
    dims = found.dims[2:]
    lengths = {dim: len(found.coordinates[dim]) for dim in dims}
    grid = sorted((d for d in dims if d != SAMPLE and lengths[d] > 1), key=lambda d: -lengths[d])
    random = [name for name in found.coordinates if name not in (*found.dims, SAMPLE)]
    if grid:
        names = tuple(dim for dim in dims if dim in grid[:2])
        return View(names, False, tuple(dim for dim in dims if dim not in names))
    if random and SAMPLE in dims:
        return View(tuple(random[:2]), True, tuple(dim for dim in dims if dim != SAMPLE))
    return None


def write_pictures(found: SweepArrays, path: Path, told: Told) -> list[Path]:
    """sweep.png and, where episodes failed, endings.png of a sweep's summaries, for several tasks
    each with its number; the paths. Nothing is drawn where nothing varies."""
    view, written = view_of(found), []
    if view is None:
        return []
    for at, task in enumerate(found.coordinates["task"]):
        number = f"-{at + 1}" if len(found.coordinates["task"]) > 1 else ""
        written.append(_measures(found, at, task, view, told, path / f"sweep{number}.png"))
        if _has_endings(found, at):
            written.append(_endings(found, at, task, view, path / f"endings{number}.png"))
    return written


def _measures(found: SweepArrays, at: int, task: str, view: View, told: Told, path: Path) -> Path:
    shown = _quantities(found, at, view, told)
    policies = found.coordinates["policy"][:MOST_POLICIES]
    columns = 1 if len(view.names) == 1 else len(policies)
    size = (max(5.5, 1.2 + 3.7 * columns) if columns > 1 else 7.5, 0.7 + 2.7 * len(shown))
    figure, axes = _sheet(len(shown), columns, size, f"{task}{_averaged(view)}")
    for row, one in enumerate(shown):
        if columns == 1 and len(view.names) == 1:
            _lines(axes[row][0], found, view, one, policies)
            continue
        low, high, drawn = np.nanmin(one.values), np.nanmax(one.values), None
        for column, policy in enumerate(policies):
            axis = axes[row][column]
            drawn = _map(
                axis, found, view, one.values[column], low, max(high, low + 1e-9), one.less
            )
            if row == 0:
                axis.set_title(shown_name(str(policy)), loc="left", fontsize=10, color=theme.INK)
            _labels(axis, found, view, row == len(shown) - 1, column == 0)
        if drawn is None:
            continue
        bar = figure.colorbar(drawn, ax=axes[row], fraction=0.05, pad=0.02)
        bar.set_label(one.title, fontsize=9, color=theme.MUTED)
        bar.ax.tick_params(labelsize=8, colors=theme.MUTED)
    for column in range(columns):
        _labels(axes[-1][column], found, view, True, column == 0 and len(view.names) > 1)
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
    spread = np.sqrt(mean(found["reward_std"][at] ** 2 / count) / points)
    failed = mean(found["falls"][at] / count)
    noise = np.sqrt(failed * (1 - failed) / (mean(count) * points))
    halves = {"mean return": APART * spread, told.failures: 100 * APART * noise}
    return [
        Shown(
            title if unit == "-" else f"{title} [{unit}]",
            mean(values),
            halves.get(title),
            title != "mean return",
        )
        for title, unit, values in measured(found, at, told)
    ]


def _lines(axis: Axes, found: SweepArrays, view: View, one: Shown, policies: np.ndarray) -> None:
    x = found.coordinates[view.names[0]]
    order = np.argsort(x)
    for which, policy in enumerate(policies):
        colour, y = COLOURS[which], one.values[which][order]
        mark = "o" if view.scattered or len(x) < 12 else None
        axis.plot(
            x[order],
            y,
            color=colour,
            lw=0 if view.scattered else 1.6,
            marker=mark,
            ms=3.5,
            label=shown_name(str(policy)),
        )
        if one.half is not None and not view.scattered:
            half = np.nan_to_num(one.half[which][order])
            axis.fill_between(x[order], y - half, y + half, color=colour, alpha=0.18, lw=0)
    axis.set_ylabel(one.title, fontsize=9, color=theme.MUTED)
    if one.title.startswith("mean"):
        axis.legend(frameon=False, fontsize=8.5)
    _scales(axis, found, view)


def _map(
    axis: Axes,
    found: SweepArrays,
    view: View,
    values: np.ndarray,
    low: float,
    high: float,
    less: bool,
) -> ScalarMappable:
    colours = "magma_r" if less else "viridis"
    x, y = (found.coordinates[name] for name in view.names)
    if view.scattered:
        drawn = axis.scatter(x, y, c=values, s=14, cmap=colours, vmin=low, vmax=high)
    else:
        drawn = axis.pcolormesh(*_cells(x, y, values), cmap=colours, vmin=low, vmax=high)
    _scales(axis, found, view)
    return drawn


def _endings(found: SweepArrays, at: int, task: str, view: View, path: Path) -> Path:
    """Which ending is the most frequent of those that are failures, where half of the episodes
    fail; along one axis the shares of all."""
    names = [n for n in ENDINGS if n not in FINE and n in found.arrays and found[n][at].any()]
    places = tuple(1 + found.dims[2:].index(dim) for dim in view.over)
    total = found["episodes"][at].sum(axis=places) if places else found["episodes"][at]
    shares = np.stack([found[n][at].sum(axis=places) / total for n in names])
    policies = found.coordinates["policy"][:MOST_POLICIES]
    title = f"{task}: how it ends{_averaged(view)}"
    figure, axes = _sheet(1, len(policies), (max(5.5, 1.2 + 3.9 * len(policies)), 3.9), title)
    for which, policy in enumerate(policies):
        axis = axes[0][which]
        if len(view.names) == 1:
            _stack(axis, found, view, shares[:, which])
        else:
            _failures(axis, found, view, shares[:, which])
        axis.set_title(shown_name(str(policy)), loc="left", fontsize=10, color=theme.INK)
        _labels(axis, found, view, True, which == 0 and len(view.names) > 1)
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
    x, y = (found.coordinates[name] for name in view.names)
    if view.scattered:
        axis.scatter(x, y, c=most, s=14, cmap=listed, vmin=-0.5, vmax=high)
    else:
        axis.pcolormesh(*_cells(x, y, most), cmap=listed, vmin=-0.5, vmax=high)
    _scales(axis, found, view)


def _stack(axis: Axes, found: SweepArrays, view: View, shares: np.ndarray) -> None:
    x = found.coordinates[view.names[0]]
    order = np.argsort(x)
    colours = [COLOURS[i % len(COLOURS)] for i in range(len(shares))]
    axis.set_facecolor(GOES_ON)
    axis.stackplot(x[order], 100 * shares[:, order], colors=colours)
    axis.set_ylim(0, 100)
    axis.set_ylabel("episodes [%]", fontsize=9, color=theme.MUTED)
    _scales(axis, found, view)


def _has_endings(found: SweepArrays, at: int) -> bool:
    return any(n in found.arrays and found[n][at].any() for n in ENDINGS if n not in FINE)


def _averaged(view: View) -> str:
    over = [dim for dim in view.over if dim != SAMPLE]
    words = [*over, *(["random axes"] if SAMPLE in view.over else [])]
    return f", mean over {', '.join(words)}" if words else ""


def _cells(x: np.ndarray, y: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, ...]:
    """Edges of both axes, and the values [x, y] as maps take them, all in order."""
    rows, columns = np.argsort(x), np.argsort(y)
    return _edges(x[rows]), _edges(y[columns]), values[np.ix_(rows, columns)].T


def _edges(values: np.ndarray) -> np.ndarray:
    """Of cells around values that rise; in the logarithm where they rise so."""
    log = logarithmic(values)
    here = np.log(values) if log else values
    middle = (here[1:] + here[:-1]) / 2
    edges = np.concatenate([[2 * here[0] - middle[0]], middle, [2 * here[-1] - middle[-1]]])
    return np.exp(edges) if log else edges


def logarithmic(values: np.ndarray) -> bool:
    """Whether values that rise do so by one factor."""
    if len(values) < 3 or values.min() <= 0:
        return False
    ratios = values[1:] / values[:-1]
    return bool(np.allclose(ratios, ratios[0], rtol=1e-3)) and ratios[0] > 1


def _scales(axis: Axes, found: SweepArrays, view: View) -> None:
    setters = (axis.set_xscale, axis.set_yscale)
    for name, set_scale in zip(view.names, setters, strict=False):
        if logarithmic(np.sort(found.coordinates[name])):
            set_scale("log")


def _labels(axis: Axes, found: SweepArrays, view: View, below: bool, left: bool) -> None:
    titles = []
    for name in view.names:
        unit = found.units.get(name, "-")
        titles.append(name if unit == "-" else f"{name} [{unit}]")
    if below:
        axis.set_xlabel(titles[0], fontsize=9.5, color=theme.MUTED)
    if left:
        axis.set_ylabel(titles[1], fontsize=9.5, color=theme.MUTED)


def _sheet(
    rows: int, columns: int, size: tuple[float, float], title: str
) -> tuple[Figure, list[list[Axes]]]:
    """`make_sheet` with rows of axes, which share neither axis."""
    figure = require("matplotlib.figure").Figure(
        figsize=size, dpi=110, facecolor=theme.PAGE, layout="constrained"
    )
    require("matplotlib.backends.backend_agg").FigureCanvasAgg(figure)
    figure.suptitle(title, x=0.012, ha="left", fontsize=12, color=theme.INK, weight="bold")
    axes = figure.subplots(rows, columns, squeeze=False).tolist()
    for axis in (one for row in axes for one in row):
        axis.set_facecolor(theme.PANEL)
        axis.tick_params(colors=theme.MUTED, labelsize=8.5, length=0, which="both")
        for spine in axis.spines.values():
            spine.set_visible(False)
    return figure, axes
