"""What of a sweep is drawn along which of its axes, and the sheets for it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from stickslip.agents.sweeps.design import SAMPLE
from stickslip.agents.sweeps.telling.scales import WIDE, cells, scale_axis
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure

    from stickslip.agents.sweeps.reading import SweepArrays

COLOURS = ("#0072B2", "#D55E00", "#008069", "#7B6A8D", "#E69F00", "#56B4E9", "#CC79A7", "#5D6B79")
MOST_POLICIES = 8


class View(NamedTuple):
    """What is drawn along which coordinates: one for lines, two for maps. scattered: of samples.
    over: dimensions, after task and policy, that are averaged."""

    names: tuple[str, ...]
    scattered: bool
    over: tuple[str, ...]


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


def coloured(
    axis: Axes,
    found: SweepArrays,
    view: View,
    values: np.ndarray,
    colours: str | Colormap,
    ends: tuple[float, float],
) -> ScalarMappable:
    """A map of values, or of samples dots: with edges, or pale ones would be lost on the panel."""
    x, y = (found.coordinates[name] for name in view.names)
    if not view.scattered:
        return axis.pcolormesh(*cells(x, y, values), cmap=colours, vmin=ends[0], vmax=ends[1])
    return axis.scatter(
        x,
        y,
        c=values,
        s=22,
        edgecolors=theme.MUTED,
        linewidths=0.6,
        cmap=colours,
        vmin=ends[0],
        vmax=ends[1],
    )


def averaged(view: View) -> str:
    """Over what a picture's values are means, behind its title."""
    over = [dim for dim in view.over if dim != SAMPLE]
    words = [*over, *(["random axes"] if SAMPLE in view.over else [])]
    return f", mean over {', '.join(words)}" if words else ""


def scales(axis: Axes, found: SweepArrays, view: View, wide: float = WIDE) -> None:
    """`scale_axis` of what is drawn. wide: of the axes [inches]."""
    for name, which in zip(view.names, "xy", strict=False):
        scale_axis(axis, which, found.coordinates[name], wide)


def labels(axis: Axes, found: SweepArrays, view: View, below: bool, left: bool) -> None:
    """Names and units of what is drawn along the axes."""
    titles = []
    for name in view.names:
        unit = found.units.get(name, "-")
        titles.append(name if unit == "-" else f"{name} [{unit}]")
    if below:
        axis.set_xlabel(titles[0], fontsize=9.5, color=theme.MUTED)
    if left:
        axis.set_ylabel(titles[1], fontsize=9.5, color=theme.MUTED)


def sheet(
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
