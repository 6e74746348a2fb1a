"""A sweep's results: a row for each episode, as one table or as arrays with labels."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.sweeps.axes import SAMPLE
from stickslip.agents.sweeps.play import ENDINGS
from stickslip.agents.sweeps.store import cell_files, read_cell, read_head
from stickslip.agents.untrusted import refusing
from stickslip.dynamics.checks import require_known, require_memory

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import pyarrow as pa

    from stickslip.agents.sweeps.plan import Plan
    from stickslip.agents.sweeps.store import Head

LABELS = ("task", "policy", "point", "seed")


def cell_table(plan: Plan, number: int, columns: dict[str, np.ndarray]) -> pa.Table:
    """A cell's table with units: task, policy, point, axes, seed, then what was kept."""
    import pyarrow as pa

    cell = plan.cells[number]
    case, points, each = plan.cases[cell.case], cell.last - cell.first, plan.episodes
    same = np.zeros(points * each, np.int8)
    arrays: dict[str, pa.Array | np.ndarray] = {
        "task": _words([case.task], same),
        "policy": _words([case.policy], same),
        "point": np.repeat(np.arange(cell.first, cell.last), each),
    }
    for name, values in plan.design.at(cell.first, cell.last).items():
        arrays[name] = np.repeat(values, each)
    arrays["seed"] = np.tile(np.arange(each, dtype=np.uint32), points)
    arrays |= columns
    if "ending" in arrays:
        arrays["ending"] = _words(ENDINGS, arrays["ending"])
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

    columns: by default all. partial: whether a sweep that is not complete will do.
    ValueError for a directory of something else, damaged files and unknown columns.
    """
    import pyarrow as pa

    path, files = Path(path), cell_files(Path(path), "sweep", partial=partial)
    wanted = None if columns is None else list(columns)
    if wanted is not None:
        require_known(wanted, read_cell(files[0]).column_names, "column of the sweep")
    parts = [read_cell(file, wanted) for file in files]
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
    grid = {axis: np.asarray(one["values"], float) for axis, one in axes.items()
            if axis not in random}  # fmt: skip
    coordinates |= grid
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
