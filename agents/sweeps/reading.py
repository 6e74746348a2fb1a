"""Reading a sweep back: as a table, or as arrays with labels."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.foreign.reading import refusing
from stickslip.agents.sweeps.design import SAMPLE
from stickslip.agents.sweeps.files.directory import chunk_path, read_about
from stickslip.agents.sweeps.files.parquet import column_names, read_chunk, require_chunk
from stickslip.agents.sweeps.playing.play import ENDINGS, summary
from stickslip.dynamics.checks import require_known, require_memory

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import pyarrow as pa

    from stickslip.agents.sweeps.files.directory import About

LABELS = ("task", "policy", "point")
"""Columns of every row before the axes."""


@dataclass(frozen=True)
class SweepArrays:
    """Arrays over named dimensions.

    dims: task, policy, the gridded axes, "sample" where axes are random, and seed where the rows
    are episodes. coordinates: the labels of each dimension, [its length]; of random axes by their
    own names, [samples]. arrays: each of the shape of dims. units: of axes and arrays. drawn: the
    tasks whose resets draw, None where that is not known. returns: of every episode, [*dims,
    episodes], beside summaries; None where no episodes were written.
    """

    dims: tuple[str, ...]
    coordinates: dict[str, np.ndarray]
    arrays: dict[str, np.ndarray]
    units: dict[str, str]
    drawn: tuple[str, ...] | None = None
    returns: np.ndarray | None = None

    def __getitem__(self, name: str) -> np.ndarray:
        """An array. ValueError for an unknown name."""
        require_known([name], self.arrays, "array of the sweep")
        return self.arrays[name]

    def at(self, name: str, **where: str | float) -> np.ndarray:
        """An array where dimensions have the nearest value, or for words this one, without them.

        ValueError for an unknown dimension or word.
        """
        require_known(where, self.dims, "dimension of the sweep")
        found = self[name]
        for dim, value in where.items():
            labels = self.coordinates[dim]
            if labels.dtype.kind in "US":
                require_known([str(value)], labels.tolist(), dim)
                place = labels.tolist().index(str(value))
            else:
                place = int(np.argmin(np.abs(labels - value)))
            found = np.take(found, [place], axis=self.dims.index(dim))
        return found.reshape(
            [n for n, dim in zip(found.shape, self.dims, strict=True) if dim not in where]
        )


def read_sweep(
    path: str | Path, columns: Sequence[str] | None = None, *, partial: bool = False
) -> pa.Table:
    """A sweep's rows as one table of PyArrow's, with units in the fields' metadata.

    columns: which, by default all. partial: whether a sweep that has not come to its end will do.
    ValueError for a directory of something else, damaged files and unknown columns.
    """
    import pyarrow as pa

    path, about = Path(path), read_about(path)
    wanted = None if columns is None else list(columns)
    files = _files(path, about, partial)
    if not files:
        raise ValueError(f"{path} has no chunk yet; accepted: a sweep that has begun")
    if wanted is not None:
        require_known(wanted, column_names(files[0]), "column of the sweep")
    parts = [read_chunk(file, wanted) for file in files]
    with refusing(f"{path}"):
        return pa.concat_tables(parts).unify_dictionaries()


def sweep_arrays(path: str | Path, *, summaries: bool = False) -> SweepArrays:
    """A whole sweep as arrays with labels.

    summaries: of its points, see docs/sweeps.md, also where episodes were written: then no more
    than a chunk of them is in memory at once. ValueError for what is not whole or not a sweep.
    """
    path, about = Path(path), read_about(path)
    whole, size = about.definition, _dims(about)
    each = [] if summaries or whole["rows"] == "summaries" else [whole["episodes"]]
    shape = (*size.values(), *each)
    require_memory(f"{path}", "numbers", math.prod(shape), 16 * 10)
    parts: list[dict[str, np.ndarray]] = []
    drawn: dict[str, np.ndarray] = {}
    returns: list[np.ndarray] = []
    for table in _tables(path, about):
        try:
            with refusing("a chunk"):
                found = _columns(table, about)
                _collect(drawn, about, table)
                if summaries and whole["rows"] == "episodes":
                    returns.append(found["reward"])
                    found = summary(found, whole["episodes"], about.finished)
                parts.append(found)
        except ValueError as error:
            raise ValueError(
                f"{path}: {error}; accepted: chunks as the sweep wrote them"
            ) from error
    coordinates = _coordinates(about, drawn)
    with refusing(f"{path}"):
        arrays = {
            name: np.concatenate([one[name] for one in parts]).reshape(shape) for name in parts[0]
        }
        kept = np.concatenate(returns).reshape(*shape, whole["episodes"]) if returns else None
    if each:
        coordinates["seed"] = np.arange(each[0])
    dims = (*size, *(["seed"] if each else []))
    units = {
        name: about.units.get(name) or about.units.get(name.rpartition("_")[0], "-")
        for name in (*coordinates, *arrays)
    }
    return SweepArrays(dims, coordinates, arrays, units, about.drawn, kept)


def _dims(about: About) -> dict[str, int]:
    whole = about.definition
    found = {"task": len(whole["tasks"]), "policy": len(whole["policies"])}
    for name, axis in about.axes.items():
        if "values" in axis:
            found[name] = len(axis["values"])
    return found | ({SAMPLE: whole["samples"]} if whole["samples"] else {})


def _collect(drawn: dict[str, np.ndarray], about: About, table: pa.Table) -> None:
    """Add to the values of random axes those of a chunk, until all samples are there."""
    whole = about.definition
    each = 1 if whole["rows"] == "summaries" else whole["episodes"]
    for name, axis in about.axes.items():
        so_far = drawn.get(name, np.zeros(0))
        if "values" not in axis and len(so_far) < whole["samples"]:
            joined = np.concatenate([so_far, np.asarray(table[name])[::each]])
            drawn[name] = joined[: whole["samples"]]


def _coordinates(about: About, drawn: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The labels of every dimension."""
    whole = about.definition
    found = {
        dim: np.asarray(list(dict.fromkeys(one[place] for one in whole["cases"])))
        for place, dim in enumerate(("task", "policy"))
    }
    for name, axis in about.axes.items():
        found[name] = np.asarray(axis["values"], float) if "values" in axis else drawn[name]
    return found | ({SAMPLE: np.arange(whole["samples"])} if whole["samples"] else {})


def _columns(table: pa.Table, about: About) -> dict[str, np.ndarray]:
    """What was kept, as NumPy arrays; endings by their numbers."""
    labels = (*LABELS, *about.axes, "seed")
    found = {}
    for name in table.column_names:
        if name in labels:
            continue
        column = table[name].combine_chunks()
        if name == "ending":
            words = column.dictionary.to_pylist()
            codes = np.asarray([ENDINGS.index(word) for word in words], np.int8)
            found[name] = codes[np.asarray(column.indices)]
        else:
            found[name] = np.asarray(column)
    return found


def _tables(path: Path, about: About) -> Iterator[pa.Table]:
    for file in _files(path, about, False):
        yield read_chunk(file)


def _files(path: Path, about: About, partial: bool) -> list[Path]:
    """The chunks in their order; ValueError where one is damaged or of another sweep, and where one
    is missing, unless partial."""
    files = [chunk_path(path, index) for index in range(about.chunks)]
    there = {index: file for index, file in enumerate(files) if file.exists()}
    for index, file in there.items():
        require_chunk(file, index, about.digest)
    if len(there) < len(files) and not partial:
        raise ValueError(
            f"{path} holds {len(there)} of {len(files)} chunks; accepted: a sweep that came to its "
            "end (go on with it by --resume), or partial=True"
        )
    return list(there.values())
