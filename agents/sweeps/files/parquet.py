"""Chunks as Parquet: every column with its unit, every file with what it belongs to."""

from __future__ import annotations

import json
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.foreign.reading import RefusedError, refusing
from stickslip.agents.sweeps.playing.play import ENDINGS
from stickslip.records.files import writing

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    import pyarrow as pa

    from stickslip.agents.sweeps.plan import Chunk, Plan

ABOUT = b"stickslip"
"""The key of a file's own metadata."""
COUNTED = ("episodes", "falls", *ENDINGS)


def chunk_table(plan: Plan, chunk: Chunk, columns: dict[str, np.ndarray]) -> pa.Table:
    """A chunk's table: task, policy, point, axes, seed of an episode, then what was kept."""
    import pyarrow as pa

    case, each = plan.cases[chunk.case], 1 if plan.summaries else plan.episodes
    points = chunk.last - chunk.first
    rows = points * each
    arrays: dict[str, tuple[pa.Array | np.ndarray, str]] = {
        "task": (_words([case.task], np.zeros(rows, np.int8)), "-"),
        "policy": (_words([case.policy], np.zeros(rows, np.int8)), "-"),
        "point": (np.repeat(np.arange(chunk.first, chunk.last), each), "-"),
    }
    for name, values in plan.design.at(chunk.first, chunk.last).items():
        arrays[name] = (np.repeat(values, each), plan.units[name])
    if not plan.summaries:
        arrays["seed"] = (np.tile(np.arange(plan.episodes, dtype=np.uint32), points), "-")
    for name, values in columns.items():
        shown = _words(ENDINGS, values) if name == "ending" else values
        arrays[name] = (shown, unit_of(plan, name))
    made = {name: pa.array(one) for name, (one, _) in arrays.items()}
    fields = [
        pa.field(name, made[name].type, metadata={"unit": unit})
        for name, (_, unit) in arrays.items()
    ]
    about = {"digest": plan.digest, "chunk": chunk.number}
    schema = pa.schema(fields, metadata={ABOUT: json.dumps(about).encode()})
    return pa.Table.from_arrays(list(made.values()), schema=schema)


def unit_of(plan: Plan, name: str) -> str:
    """Of a column of what was kept."""
    if name in COUNTED:
        return "-"
    return plan.kept_units.get(name) or plan.kept_units.get(name.rpartition("_")[0], "-")


def write_chunk(path: Path, table: pa.Table) -> None:
    """Write a table whole or not at all."""
    from pyarrow import parquet

    with writing(path) as file:
        parquet.write_table(table, file, compression="zstd")


def require_chunk(path: Path, index: int, digest: str, rows: int | None = None) -> None:
    """Raise ValueError naming the file unless it is the chunk of that sweep, whole. rows: None for
    any number."""
    from pyarrow import parquet

    with _chunk_at(path):
        found = parquet.read_metadata(path)
        about = json.loads((found.metadata or {}).get(ABOUT, b"{}"))
        if about.get("digest") != digest or about.get("chunk") != index:
            raise RefusedError("it belongs to another sweep")
        if rows is not None and found.num_rows != rows:
            raise RefusedError(f"it has {found.num_rows} rows, not {rows}")


def read_chunk(path: Path, columns: list[str] | None = None) -> pa.Table:
    """A chunk's table. ValueError naming a file that is damaged."""
    from pyarrow import parquet

    with _chunk_at(path):
        return parquet.read_table(path, columns=columns)


def column_names(path: Path) -> list[str]:
    """Of a chunk's table, likewise."""
    from pyarrow import parquet

    with _chunk_at(path):
        return list(parquet.read_schema(path).names)


@contextmanager
def _chunk_at(path: Path) -> Iterator[None]:
    """Whatever goes wrong inside is the file's."""
    try:
        with refusing("it"):
            yield
    except ValueError as error:
        raise ValueError(
            f"{path}: {error}; accepted: a chunk as the sweep wrote it; move the file away, and "
            "--resume plays it again"
        ) from error


def _words(names: Iterable[str], codes: np.ndarray) -> pa.DictionaryArray:
    import pyarrow as pa

    return pa.DictionaryArray.from_arrays(pa.array(codes.astype(np.int8)), pa.array(list(names)))
