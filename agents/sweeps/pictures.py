"""The two plots of a sweep: returns and failures over the axes, and how episodes end."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.pictures.sheet import make_sheet, save_sheet
from stickslip.agents.sweeps.axes import SAMPLE
from stickslip.agents.sweeps.play import ENDINGS
from stickslip.agents.sweeps.statistics import Z95, is_random, slip_of
from stickslip.envs.rendering import theme

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable

    from stickslip.agents.sweeps.data import SweepArrays

COLOURS = ("#0072B2", "#D55E00", "#008069", "#7B6A8D", "#E69F00", "#56B4E9", "#CC79A7", "#5D6B79")
NO_FAILURES = ("ok", "slip_onset", "step_complete")
MOST_POLICIES, TICKS = 8, 6
OUTLIERS = 2.0
"""Percentiles beyond which values of a map saturate its colours."""


class View(NamedTuple):
    """One or two coordinates to draw along; samples: whether they are random ones."""

    names: tuple[str, ...]
    samples: bool


def view_of(found: SweepArrays) -> View | None:
    """The two longest gridded axes, else the first two random ones; None where nothing varies."""
    lengths = {dim: len(found.coordinates[dim]) for dim in found.dims[2:-1]}
    varied = [dim for dim in lengths if dim != SAMPLE and lengths[dim] > 1]
    longest = sorted(varied, key=lambda dim: -lengths[dim])[:2]
    if longest:
        return View(tuple(dim for dim in varied if dim in longest), False)
    random = [name for name in found.coordinates if name not in found.dims]
    return View(tuple(random[:2]), True) if random else None


def write_pictures(
    found: SweepArrays, path: Path, slip: tuple[str, str] | None = None
) -> list[Path]:
    """Write sweep.png and, where episodes failed, endings.png, numbered where there are several
    tasks. Nothing is drawn where nothing varies."""
    view, written = view_of(found), []
    if view is None:
        return []
    for t, task in enumerate(found.coordinates["task"]):
        number = f"-{t + 1}" if len(found.coordinates["task"]) > 1 else ""
        written.append(_draw_measures(found, t, view, slip, path / f"sweep{number}.png", str(task)))
        if failures := _failures(found, t):
            target = path / f"endings{number}.png"
            written.append(_draw_endings(found, t, view, failures, target, str(task)))
    return written


def _mean(found: SweepArrays, values: np.ndarray, view: View) -> np.ndarray:
    """Mean of finite values [policies, *axes, ...] over the axes that are not drawn."""
    dims = found.dims[2:-1]
    drawn = (SAMPLE,) if view.samples else view.names
    over = tuple(1 + place for place, dim in enumerate(dims) if dim not in drawn)
    return np.ma.filled(np.ma.masked_invalid(values).mean(axis=over), np.nan) if over else values


def _draw_measures(
    found: SweepArrays, t: int, view: View, slip: tuple[str, str] | None, path: Path, task: str
) -> Path:
    returns = _mean(found, found["reward"][t].astype(float), view)
    count = returns.shape[-1]
    half = Z95 * returns.std(axis=-1, ddof=1) / np.sqrt(count) if count > 1 else None
    half = half if is_random(found, t) else None
    shown = [("mean return", returns.mean(axis=-1), half)]
    failed = _mean(found, found["fell"][t].mean(axis=-1), view)
    shown.append(("failures [%]", 100 * failed, None))
    slid = slip_of(found, slip)
    if slid is not None and np.isfinite(slid[t]).any():
        shown.append(("distance slid [m/m]", _mean(found, slid[t], view), None))
    names = [str(one) for one in found.coordinates["policy"][:MOST_POLICIES]]
    lines = len(view.names) == 1
    columns = 1 if lines else len(names)
    size = (7.5 if lines else max(5.5, 1.2 + 3.7 * columns), 0.7 + 2.7 * len(shown))
    figure, axes = make_sheet(len(shown), columns, size, task)
    for row, (title, values, error) in enumerate(shown):
        mine = axes[row * columns : (row + 1) * columns]
        if lines:
            _lines(mine[0], found, view, values, error, names)
            mine[0].set_ylabel(title, fontsize=9, color=theme.MUTED)
            continue
        known = values[np.isfinite(values)]
        ends = np.percentile(known, (OUTLIERS, 100 - OUTLIERS)) if known.size else (0, 1)
        drawn = [_map(axis, found, view, one, "viridis", tuple(ends))
                 for axis, one in zip(mine, values, strict=False)]  # fmt: skip
        beyond = known.size and (known.min() < ends[0] or known.max() > ends[1])
        extend = "both" if beyond else "neither"
        bar = figure.colorbar(drawn[0], ax=mine, fraction=0.05, pad=0.02, extend=extend)
        bar.set_label(title, fontsize=9, color=theme.MUTED)
    if lines:
        axes[0].legend(frameon=False, fontsize=8.5)
    else:
        _titles(axes[:columns], names)
    _labels(axes, columns, found, view)
    return save_sheet(figure, path)


def _failures(found: SweepArrays, t: int) -> list[str]:
    """Endings of a task's episodes that are failures."""
    codes = np.unique(found["ending"][t]) if "ending" in found.arrays else ()
    return [ENDINGS[code] for code in codes if ENDINGS[code] not in NO_FAILURES]


def _draw_endings(
    found: SweepArrays, t: int, view: View, names: Sequence[str], path: Path, task: str
) -> Path:
    """Shares of the endings along one axis; over two, the most frequent where half fail."""
    codes = found["ending"][t]
    shares = np.stack([
        _mean(found, (codes == ENDINGS.index(name)).mean(axis=-1), view) for name in names
    ])  # fmt: skip
    policies = [str(one) for one in found.coordinates["policy"][:MOST_POLICIES]]
    size = (max(5.5, 1.2 + 3.9 * len(policies)), 3.9)
    figure, axes = make_sheet(1, len(policies), size, f"{task}: endings")
    colours = [COLOURS[i % len(COLOURS)] for i in range(len(names))]
    for p, axis in enumerate(axes):
        if len(view.names) == 1:
            _stack(axis, found, view, shares[:, p], names, colours)
            continue
        from matplotlib.colors import ListedColormap

        most = np.where(shares[:, p].sum(axis=0) >= 0.5, 1 + np.argmax(shares[:, p], axis=0), 0)
        palette = ListedColormap([theme.RULE, *colours])
        _map(axis, found, view, most, palette, (-0.5, len(names) + 0.5))
        for colour, name in zip(colours, names, strict=True):
            axis.plot([], [], "s", color=colour, label=name.replace("_", " "))
    _titles(axes, policies)
    _labels(axes, len(axes), found, view)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4,
                  frameon=False, fontsize=9)  # fmt: skip
    return save_sheet(figure, path)


def _stack(
    axis: Axes,
    found: SweepArrays,
    view: View,
    shares: np.ndarray,
    names: Sequence[str],
    colours: Sequence[str],
) -> None:
    x = found.coordinates[view.names[0]]
    order = np.argsort(x)
    labels = [name.replace("_", " ") for name in names]
    axis.stackplot(x[order], 100 * shares[:, order], labels=labels, colors=colours)
    axis.set_ylim(0, 100)
    axis.set_ylabel("episodes [%]", fontsize=9, color=theme.MUTED)
    _scale(axis, "x", x)


def _lines(
    axis: Axes,
    found: SweepArrays,
    view: View,
    values: np.ndarray,
    half: np.ndarray | None,
    names: Sequence[str],
) -> None:
    x = found.coordinates[view.names[0]]
    order = np.argsort(x)
    style = {"lw": 0, "marker": "o"} if view.samples else {"lw": 1.6, "marker": "o"}
    for p, name in enumerate(names):
        y = values[p][order]
        axis.plot(x[order], y, color=COLOURS[p], ms=3.5, label=name, **style)
        if half is not None and not view.samples:
            error = half[p][order]
            axis.fill_between(x[order], y - error, y + error, color=COLOURS[p], alpha=0.18, lw=0)
    _scale(axis, "x", x)


def _map(
    axis: Axes,
    found: SweepArrays,
    view: View,
    values: np.ndarray,
    colours: object,
    ends: tuple[float, ...],
) -> ScalarMappable:
    """A map of values [x, y], or dots at samples."""
    x, y = (found.coordinates[name] for name in view.names)
    how = {"cmap": colours, "vmin": ends[0], "vmax": ends[1]}
    _scale(axis, "x", x)
    _scale(axis, "y", y)
    if view.samples:
        return axis.scatter(x, y, c=values, s=22, edgecolors=theme.MUTED, linewidths=0.6, **how)
    rows, columns = np.argsort(x), np.argsort(y)
    cells = values[np.ix_(rows, columns)].T
    return axis.pcolormesh(x[rows], y[columns], cells, shading="nearest", **how)


def _scale(axis: Axes, which: str, values: np.ndarray) -> None:
    """Ticks at values that were played; a logarithmic scale where they rise by one factor."""
    rising = np.unique(values)
    if len(rising) > 2 and rising[0] > 0:
        ratios = rising[1:] / rising[:-1]
        if np.allclose(ratios, ratios[0], rtol=1e-3):
            getattr(axis, f"set_{which}scale")("log")
    shown = rising[np.unique(np.linspace(0, len(rising) - 1, TICKS).round().astype(int))]
    getattr(axis, f"set_{which}ticks")(shown, [f"{one:.3g}" for one in shown])
    getattr(axis, f"set_{which}ticks")([], minor=True)


def _titles(axes: Sequence[Axes], names: Sequence[str]) -> None:
    for axis, name in zip(axes, names, strict=True):
        axis.set_title(name, loc="left", fontsize=10, color=theme.INK)


def _labels(axes: Sequence[Axes], columns: int, found: SweepArrays, view: View) -> None:
    """Names and units of the axes, at the left and at the bottom."""
    units = (found.units.get(name, "-") for name in view.names)
    titles = [n if u == "-" else f"{n} [{u}]" for n, u in zip(view.names, units, strict=True)]
    for axis in axes[-columns:]:
        axis.set_xlabel(titles[0], fontsize=9.5, color=theme.MUTED)
    for axis in axes[::columns] if len(titles) > 1 else ():
        axis.set_ylabel(titles[1], fontsize=9.5, color=theme.MUTED)
