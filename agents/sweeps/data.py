"""Results of a sweep: a row for each episode, as one table or as arrays with labels."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.sweeps.axes import SAMPLE
from stickslip.agents.sweeps.cells import cell_files, read_cells, read_head
from stickslip.agents.sweeps.plan import ENDINGS
from stickslip.agents.untrusted import refusing
from stickslip.dynamics.checks import require_known, require_memory

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import pyarrow as pa

    from stickslip.agents.sweeps.cells import Head
    from stickslip.agents.sweeps.plan import Plan

LABELS = ("task", "policy", "point", "seed")


def cell_table(plan: Plan, number: int, columns: dict[str, np.ndarray]) -> pa.Table:
    """A cell's table with units: task, policy, point, axes, seed, then what was kept."""
    import pyarrow as pa

    cell = plan.at(number)
    case = plan.cases[cell.case]
    points, seeds = np.divmod(np.arange(cell.first, cell.last), plan.episodes)
    same = np.zeros(len(points), np.int8)
    arrays: dict[str, pa.Array | np.ndarray] = {
        "task": _words([case.task], same),
        "policy": _words([case.policy], same),
        "point": points,
        **plan.design.at(points),
        "seed": seeds.astype(np.uint32),
        **columns,
    }
    if "ending" in arrays:
        arrays["ending"] = _words(ENDINGS, columns["ending"])
    made = {name: pa.array(one) for name, one in arrays.items()}
    fields = [
        pa.field(name, one.type, metadata={"unit": plan.units.get(name, "-")})
        for name, one in made.items()
    ]
    return pa.Table.from_arrays(list(made.values()), schema=pa.schema(fields))


def read_sweep(
    path: str | Path, columns: Sequence[str] | None = None, *, partial: bool = False
) -> pa.Table:
    """A sweep's rows as one PyArrow table, with units in the fields' metadata.

    columns: by default all. partial: accept a sweep that is not complete.
    ValueError for a directory of something else, damaged files and unknown columns.
    """
    import pyarrow as pa
    from pyarrow import parquet

    path = Path(path)
    files = cell_files(path, "sweep").values()
    if columns is not None and files:
        known = parquet.read_schema(next(iter(files))).names
        require_known(list(columns), known, "column of the sweep")
    parts = list(read_cells(path, "sweep", columns, partial=partial))
    with refusing(f"{path}"):
        return pa.concat_tables(parts).unify_dictionaries()


@dataclass(frozen=True)
class SweepArrays:
    """Arrays over named dimensions.

    dims: task, policy, the gridded axes, "sample" where axes are random, seed. coordinates: labels
    of each dimension; of random axes by their own names, [samples]. arrays: each of the shape of
    dims. units: of axes and arrays. random: tasks whose resets draw.
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
    try:
        with refusing("it"):
            return _arrays(head, table, str(path))
    except ValueError as error:
        raise ValueError(f"{path}: {error}; accepted: a sweep as it was written") from error


def _arrays(head: Head, table: pa.Table, name: str) -> SweepArrays:
    whole, axes = head["definition"], head["definition"]["axes"]
    coordinates = {
        dim: np.asarray(list(dict.fromkeys(one[place] for one in whole["cases"])))
        for place, dim in enumerate(("task", "policy"))
    }
    random = [axis for axis, one in axes.items() if one["values"] is None]
    coordinates |= {
        axis: np.asarray(one["values"], float) for axis, one in axes.items() if axis not in random
    }
    if whole["samples"]:
        coordinates[SAMPLE] = np.arange(whole["samples"])
    coordinates["seed"] = np.arange(whole["episodes"])
    dims = tuple(coordinates)
    shape = tuple(map(len, coordinates.values()))
    require_memory(name, "numbers", math.prod(shape), 16 * 10)
    for axis in random:
        coordinates[axis] = np.asarray(table[axis])[:: whole["episodes"]][: whole["samples"]]
    arrays = {
        column: _numbers(table[column], column).reshape(shape)
        for column in table.column_names
        if column not in (*LABELS, *axes)
    }
    units = {one: head["units"].get(one, "-") for one in (*coordinates, *arrays)}
    return SweepArrays(dims, coordinates, arrays, units, tuple(head["random"]))


def _numbers(column: pa.ChunkedArray, name: str) -> np.ndarray:
    """A column as NumPy array; endings by their number in ENDINGS."""
    if name != "ending":
        return np.asarray(column)
    codes = column.combine_chunks()
    known = np.asarray([ENDINGS.index(one) for one in codes.dictionary.to_pylist()], np.int8)
    return known[np.asarray(codes.indices)]


def _words(names: Iterable[str], codes: np.ndarray) -> pa.DictionaryArray:
    import pyarrow as pa

    return pa.DictionaryArray.from_arrays(pa.array(codes.astype(np.int8)), pa.array(list(names)))
