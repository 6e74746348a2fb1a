"""The plot of a sweep: returns, failures and slip over the axes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.sweeps.data import Z95, SweepArrays, slip_of
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.sheet import make_sheet, save_sheet, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


COLOURS = (*theme.PLAYERS, theme.HIP_EDGE, theme.MUTED)
"""Colours of the policies; no more are drawn."""
TICKS = 6
OUTLIERS = 2.0
"""Percentiles beyond which values of a map saturate its colours."""


class Panel(NamedTuple):
    """A quantity [policies, x] or [policies, x, y], and the half-width of its interval."""

    title: str
    values: np.ndarray
    half: np.ndarray | None = None


def drawn_axes(found: SweepArrays) -> tuple[str, ...]:
    """The two longest axes of those that vary, in their order."""
    lengths = {dim: len(found.coordinates[dim]) for dim in found.dims[2:-1]}
    varied = [dim for dim in lengths if lengths[dim] > 1]
    longest = sorted(varied, key=lambda dim: -lengths[dim])[:2]
    return tuple(dim for dim in varied if dim in longest)


@styled
def write_pictures(
    found: SweepArrays, path: Path, slip: tuple[str, str] | None = None
) -> list[Path]:
    """Write sweep.png, numbered where there are several tasks. Nothing is drawn where nothing
    varies."""
    view, written = drawn_axes(found), []
    if not view:
        return []
    for t, task in enumerate(found.coordinates["task"]):
        number = f"-{t + 1}" if len(found.coordinates["task"]) > 1 else ""
        figure = _drawn(found, view, _measures(found, t, view, slip), str(task))
        written.append(save_sheet(figure, path / f"sweep{number}.png"))
    return written


def _mean(found: SweepArrays, values: np.ndarray, view: Sequence[str]) -> np.ndarray:
    """Mean of finite values [policies, *axes, ...] over the axes that are not drawn."""
    over = tuple(i for i, dim in enumerate(found.dims[2:-1], 1) if dim not in view)
    return np.ma.filled(np.ma.masked_invalid(values).mean(axis=over), np.nan) if over else values


def _measures(
    found: SweepArrays, t: int, view: Sequence[str], slip: tuple[str, str] | None
) -> list[Panel]:
    returns = _mean(found, found["reward"][t].astype(float), view)
    count, half = returns.shape[-1], None
    if count > 1 and found.is_random(t):
        half = Z95 * returns.std(axis=-1, ddof=1) / np.sqrt(count)
    panels = [Panel("mean return", returns.mean(axis=-1), half)]
    failed = _mean(found, found["fell"][t].mean(axis=-1), view)
    panels.append(Panel("failures [%]", 100 * failed))
    slid = slip_of(found, slip)
    if slid is not None and np.isfinite(slid[t]).any():
        panels.append(Panel("distance slid [m/m]", _mean(found, slid[t], view)))
    return panels


def _drawn(found: SweepArrays, view: Sequence[str], panels: Sequence[Panel], task: str) -> Figure:
    """A row for each panel: lines of all policies along one axis, or a map for each policy."""
    names = [str(one) for one in found.coordinates["policy"][: len(COLOURS)]]
    units = (found.units.get(name, "-") for name in view)
    titles = [n if u == "-" else f"{n} [{u}]" for n, u in zip(view, units, strict=True)]
    lines = len(titles) == 1
    columns = 1 if lines else len(names)
    size = (7.5 if lines else max(5.5, 1.2 + 3.7 * columns), 0.7 + 2.7 * len(panels))
    figure, axes = make_sheet(len(panels), columns, size, task)
    for row, panel in enumerate(panels):
        mine = axes[row * columns : (row + 1) * columns]
        if lines:
            _lines(mine[0], found, view, panel, names)
        else:
            _maps(figure, mine, found, view, panel)
            mine[0].set_ylabel(titles[1])
    if lines:
        axes[0].legend()
    else:
        for axis, name in zip(axes, names, strict=False):
            axis.set_title(name)
    for axis in axes[-columns:]:
        axis.set_xlabel(titles[0])
    return figure


def _lines(
    axis: Axes, found: SweepArrays, view: Sequence[str], panel: Panel, names: Sequence[str]
) -> None:
    x = found.coordinates[view[0]]
    order = np.argsort(x)
    for p, name in enumerate(names):
        y = panel.values[p][order]
        axis.plot(x[order], y, "o-", color=COLOURS[p], ms=3.5, lw=1.6, label=name)
        if panel.half is not None:
            error = panel.half[p][order]
            axis.fill_between(x[order], y - error, y + error, color=COLOURS[p], alpha=0.18, lw=0)
    axis.set_ylabel(panel.title)
    _scale(axis, "x", x)


def _maps(
    figure: Figure, axes: Sequence[Axes], found: SweepArrays, view: Sequence[str], panel: Panel
) -> None:
    """A map of values [x, y] for each policy, in one scale of colours."""
    x, y = (found.coordinates[name] for name in view)
    rows, columns = np.argsort(x), np.argsort(y)
    known = panel.values[np.isfinite(panel.values)]
    low, high = np.percentile(known, (OUTLIERS, 100 - OUTLIERS)) if known.size else (0, 1)
    how, drawn = {"cmap": "viridis", "vmin": low, "vmax": high}, []
    for axis, values in zip(axes, panel.values, strict=False):
        _scale(axis, "x", x)
        _scale(axis, "y", y)
        cells = values[np.ix_(rows, columns)].T
        drawn.append(axis.pcolormesh(x[rows], y[columns], cells, shading="nearest", **how))
    beyond = known.size and (known.min() < low or known.max() > high)
    extend = "both" if beyond else "neither"
    bar = figure.colorbar(drawn[0], ax=axes, fraction=0.05, pad=0.02, extend=extend)
    bar.set_label(panel.title)


def _scale(axis: Axes, which: str, values: np.ndarray) -> None:
    """Ticks at values that were played; a logarithmic scale where they rise by one factor."""
    rising = np.unique(values)
    if len(rising) > 2 and rising[0] > 0 and np.ptp(np.diff(np.log(rising))) < 1e-3:
        axis.set(**{f"{which}scale": "log"})
    shown = rising[np.unique(np.linspace(0, len(rising) - 1, TICKS).round().astype(int))]
    getattr(axis, f"set_{which}ticks")(shown, [f"{one:.3g}" for one in shown])
    getattr(axis, f"set_{which}ticks")([], minor=True)
