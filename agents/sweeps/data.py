"""Results of a sweep: a row for each episode, as one table or as arrays with labels; a summary, and
plots of returns, failures and slip over the axes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.sweeps.cells import CELL_FILE, cell_files, read_head
from stickslip.agents.sweeps.plan import ENDINGS, Plan
from stickslip.agents.sweeps.swept import values_at
from stickslip.agents.untrusted import reading, refusing
from stickslip.dynamics.checks import require_known, require_memory
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.sheet import make_sheet, save_sheet, styled
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    import pyarrow as pa
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


LABELS = ("task", "policy", "point", "seed")
Z95 = 1.96
LEAST_DISTANCE = 0.1
"""Mean distance below which no slip per metre is given [m]."""


def cell_table(plan: Plan, number: int, columns: dict[str, np.ndarray]) -> pa.Table:
    """A cell's table with units: task, policy, point, axes, seed, then what was kept."""
    import pyarrow as pa

    case, first, last = plan.at(number)
    points, seeds = np.divmod(np.arange(first, last), plan.episodes)

    def words(names: Sequence[str], codes: np.ndarray) -> pa.DictionaryArray:
        return pa.DictionaryArray.from_arrays(pa.array(codes), pa.array(list(names)))

    same = np.zeros(len(points), np.int8)
    arrays: dict[str, pa.Array | np.ndarray] = {
        "task": words([case.task], same),
        "policy": words([case.policy], same),
        "point": points,
        **values_at(plan.axes, points),
        "seed": seeds.astype(np.uint32),
        **columns,
    }
    if "ending" in arrays:
        arrays["ending"] = words(ENDINGS, columns["ending"])
    made = {name: pa.array(one) for name, one in arrays.items()}
    about = {name: {"unit": plan.units.get(name, "-")} for name in made}
    fields = [pa.field(name, one.type, metadata=about[name]) for name, one in made.items()]
    return pa.Table.from_arrays(list(made.values()), schema=pa.schema(fields))


def read_sweep(path: str | Path) -> pa.Table:
    """A complete sweep's rows as one PyArrow table, with units in the fields' metadata.

    ValueError for a directory of something else and for damaged files.
    """
    import pyarrow as pa
    from pyarrow import parquet

    path = Path(path)
    files, count, parts = cell_files(path, "sweep"), read_head(path, "sweep")["cells"], []
    if len(files) < count:
        given = f"{path} holds {len(files)} of {count} cells"
        raise ValueError(f"{given}; accepted: a complete sweep, --resume continues it")
    for file in files.values():
        with reading(file, CELL_FILE):
            parts.append(parquet.read_table(file, page_checksum_verification=True))
    with refusing(f"{path}"):
        return pa.concat_tables(parts).unify_dictionaries()


@dataclass(frozen=True)
class SweepArrays:
    """Arrays over named dimensions.

    dims: task, policy, the axes, seed. coordinates: labels of each dimension. arrays: each of the
    shape of dims. units: of axes and arrays. random: tasks whose resets draw.
    """

    dims: tuple[str, ...]
    coordinates: dict[str, np.ndarray]
    arrays: dict[str, np.ndarray]
    units: dict[str, str]
    random: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> np.ndarray:
        """An array by name. ValueError for an unknown one."""
        require_known([name], self.arrays, "array of the sweep")
        return self.arrays[name]


def sweep_arrays(path: str | Path) -> SweepArrays:
    """A complete sweep as arrays with labels. ValueError for what is incomplete or no sweep."""
    path = Path(path)
    head, table = read_head(path, "sweep"), read_sweep(path)
    with reading(path, "a sweep as it was written"):
        whole, axes = head["definition"], head["definition"]["axes"]
        coordinates = {
            dim: np.asarray(list(dict.fromkeys(one[place] for one in whole["cases"])))
            for place, dim in enumerate(("task", "policy"))
        }
        coordinates |= {axis: np.asarray(one["values"], float) for axis, one in axes.items()}
        coordinates["seed"] = np.arange(whole["episodes"])
        shape = tuple(map(len, coordinates.values()))
        require_memory(str(path), "numbers", math.prod(shape), 16 * 10)
        arrays = {}
        for column in table.column_names:
            found = table[column]
            if column == "ending":  # by its number in ENDINGS
                codes = found.combine_chunks()
                known = [ENDINGS.index(one) for one in codes.dictionary.to_pylist()]
                found = np.asarray(known, np.int8)[np.asarray(codes.indices)]
            if column not in (*LABELS, *axes):
                arrays[column] = np.asarray(found).reshape(shape)
        units = {one: head["units"].get(one, "-") for one in (*coordinates, *arrays)}
        return SweepArrays(tuple(coordinates), coordinates, arrays, units, tuple(head["random"]))


def summary_table(found: SweepArrays, slip: tuple[str, str] | None = None) -> Table:
    """A row for each task and policy, over all its points.

    point_mean_least, point_mean_most: of the means at single points. failures: share of episodes.
    slip_worst: slip per distance travelled at the worst point.
    """
    heads = [Column(name, words=True) for name in ("task", "policy")]
    names = ("points", "episodes", "return_mean", "point_mean_least", "point_mean_most")
    heads += [*map(Column, (*names, "failures"))]
    heads += [] if slip is None else [Column("slip_worst", "m/m")]
    returns, policies = found["reward"].astype(float), found.coordinates["policy"]
    means, slid = returns.mean(axis=-1), slip_of(found, slip)
    rows = []
    for t, task in enumerate(found.coordinates["task"]):
        for p, policy in enumerate(policies):
            here = means[t, p]
            row = [str(task), str(policy), here.size, returns[t, p].size, float(here.mean())]
            row += [float(here.min()), float(here.max()), float(found["fell"][t, p].mean())]
            if slid is not None:
                known = slid[t, p][np.isfinite(slid[t, p])]
                row.append(float(known.max()) if known.size else None)
            rows.append(row)
    return Table(heads, rows)


def slip_of(found: SweepArrays, slip: tuple[str, str] | None) -> np.ndarray | None:
    """Slip per distance travelled at every point; NaN where nothing moves."""
    if slip is None:
        return None
    slid, distance = (np.abs(found[name].astype(float)).mean(axis=-1) for name in slip)
    moves = distance >= LEAST_DISTANCE
    return np.where(moves, slid / np.where(moves, distance, 1.0), np.nan)


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
    """Write sweep.png, numbered where there are several tasks; none where nothing varies."""
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
    if count > 1 and str(found.coordinates["task"][t]) in found.random:
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
    titles = [Column(name, found.units.get(name, "-")).title for name in view]
    values, lines = [found.coordinates[name] for name in view], len(titles) == 1
    columns = 1 if lines else len(names)
    size = (7.5 if lines else max(5.5, 1.2 + 3.7 * columns), 0.7 + 2.7 * len(panels))
    figure, axes = make_sheet(len(panels), columns, size, task)
    for row, panel in enumerate(panels):
        mine = axes[row * columns : (row + 1) * columns]
        if lines:
            _lines(mine[0], panel, names, *values)
        else:
            _maps(figure, mine, panel, *values)
            mine[0].set_ylabel(titles[1])
    if lines:
        axes[0].legend()
    else:
        for axis, name in zip(axes, names, strict=False):
            axis.set_title(name)
    for axis in axes[-columns:]:
        axis.set_xlabel(titles[0])
    return figure


def _lines(axis: Axes, panel: Panel, names: Sequence[str], x: np.ndarray) -> None:
    order = np.argsort(x)
    for p, name in enumerate(names):
        y = panel.values[p][order]
        axis.plot(x[order], y, "o-", color=COLOURS[p], ms=3.5, lw=1.6, label=name)
        if panel.half is not None:
            error = panel.half[p][order]
            axis.fill_between(x[order], y - error, y + error, color=COLOURS[p], alpha=0.18, lw=0)
    axis.set_ylabel(panel.title)
    _scale(axis, "x", x)


def _maps(figure: Figure, axes: Sequence[Axes], panel: Panel, x: np.ndarray, y: np.ndarray) -> None:
    """A map of values [x, y] for each policy, in one scale of colours."""
    rows, columns = np.argsort(x), np.argsort(y)
    known = panel.values[np.isfinite(panel.values)]
    low, high = np.percentile(known, (OUTLIERS, 100 - OUTLIERS)) if known.size else (0, 1)
    high = high if high > low else low + 1  # all panels have one range, of one value, too
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
