"""Results of a sweep: a row for each episode, as one table or as arrays with labels; a summary."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.sweeps.cells import CELL_FILE, Head, cell_files, read_head
from stickslip.agents.sweeps.plan import ENDINGS, Plan, values_at
from stickslip.agents.untrusted import reading, refusing
from stickslip.dynamics.checks import require_known, require_memory
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    import pyarrow as pa


LABELS = ("task", "policy", "point", "seed")
Z95 = 1.96
LEAST_DISTANCE = 0.1
"""Mean distance below which no slip per metre is given [m]."""


def cell_table(plan: Plan, number: int, columns: dict[str, np.ndarray]) -> pa.Table:
    """A cell's table with units: task, policy, point, axes, seed, then what was kept."""
    import pyarrow as pa

    cell = plan.at(number)
    case = plan.cases[cell.case]
    points, seeds = np.divmod(np.arange(cell.first, cell.last), plan.episodes)

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
    fields = [
        pa.field(name, one.type, metadata={"unit": plan.units.get(name, "-")})
        for name, one in made.items()
    ]
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
        raise ValueError(
            f"{path} holds {len(files)} of {count} cells; accepted: a complete sweep, --resume "
            "continues it"
        )
    for file in files.values():
        with reading(file, CELL_FILE):
            parts.append(parquet.read_table(file))
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

    def is_random(self, task: int) -> bool:
        """True if resets of the task of this index draw."""
        return str(self.coordinates["task"][task]) in self.random


def sweep_arrays(path: str | Path) -> SweepArrays:
    """A complete sweep as arrays with labels. ValueError for what is incomplete or no sweep."""
    path = Path(path)
    head, table = read_head(path, "sweep"), read_sweep(path)
    with reading(path, "a sweep as it was written"):
        return _arrays(head, table, str(path))


def _arrays(head: Head, table: pa.Table, name: str) -> SweepArrays:
    whole, axes = head["definition"], head["definition"]["axes"]
    coordinates = {
        dim: np.asarray(list(dict.fromkeys(one[place] for one in whole["cases"])))
        for place, dim in enumerate(("task", "policy"))
    }
    coordinates |= {axis: np.asarray(one["values"], float) for axis, one in axes.items()}
    coordinates["seed"] = np.arange(whole["episodes"])
    dims = tuple(coordinates)
    shape = tuple(map(len, coordinates.values()))
    require_memory(name, "numbers", math.prod(shape), 16 * 10)
    arrays = {}
    for column in table.column_names:
        if column == "ending":  # by its number in ENDINGS
            codes = table[column].combine_chunks()
            known = [ENDINGS.index(one) for one in codes.dictionary.to_pylist()]
            arrays[column] = np.asarray(known, np.int8)[np.asarray(codes.indices)].reshape(shape)
        elif column not in (*LABELS, *axes):
            arrays[column] = np.asarray(table[column]).reshape(shape)
    units = {one: head["units"].get(one, "-") for one in (*coordinates, *arrays)}
    return SweepArrays(dims, coordinates, arrays, units, tuple(head["random"]))


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
