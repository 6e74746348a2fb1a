"""A directory of numbered Parquet files, `data/cell-000000.parquet`, and a JSON file beside them
that says what they belong to. Sweeps and races keep their results so.

Files are written atomically, by one process at a time; a run resumes with the missing cells.
"""

from __future__ import annotations

import hashlib
import json
import platform
import re
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from stickslip.agents.untrusted import (
    RefusedError,
    parse_json,
    read_text,
    refusing,
    require_format,
)
from stickslip.dynamics.checks import shown
from stickslip.records.files import is_remains, write_whole, writing
from stickslip.records.table import json_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    import pyarrow as pa


Head: TypeAlias = "dict[str, Any]"
"""The JSON file of a store."""
VERSION = 2
DATA, KEY = "data", b"stickslip"
CELL = re.compile(r"cell-(\d{6})\.parquet")
MOST_CELLS = 10**6
PACKAGES = ("stickslip", "jax", "jaxlib", "numpy", "scipy", "pyarrow", "distributed")


def digest_of_text(text: str) -> str:
    """SHA-256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()


def cell_path(path: Path, number: int) -> Path:
    """Path of a cell's file."""
    return path / DATA / f"cell-{number:06d}.parquet"


def open_store(
    path: Path,
    kind: str,
    *,
    definition: Mapping[str, object],
    digest: str,
    cells: int,
    about: Mapping[str, object],
    resume: bool,
) -> Head:
    """Make the directory of a "sweep" or "race", or take up the one that is there; return its head.

    ValueError where it holds something else, another definition or, unless resume, anything.
    """
    head = f"{kind}.json"
    held = [one.name for one in path.iterdir() if not is_remains(one.name, (head,))]
    if held and head not in held:
        names = ", ".join(sorted(held)[:5])
        raise ValueError(f"{path} holds {names}, but no {kind}; accepted: a new directory")
    if held and resume:
        found = read_head(path, kind)
        if found["digest"] != digest:
            differing = ", ".join(_differing(found["definition"], definition))
            raise ValueError(
                f"{path} was begun with another definition: {differing}; accepted: to resume "
                "without changing it, or a new directory"
            )
        return found
    if held:
        raise ValueError(
            f"{path} exists and is not empty; accepted: a new directory, or --resume to continue "
            f"the {kind} in it"
        )
    (path / DATA).mkdir(parents=True, exist_ok=True)
    content = {
        "format": f"stickslip {kind}",
        "version": VERSION,
        "digest": digest,
        "definition": definition,
        "cells": cells,
        **about,
        "begun": datetime.now(UTC).isoformat(timespec="seconds"),
        "versions": versions(),
    }
    write_whole(path / head, json_text(content))
    return content


def read_head(path: Path, kind: str) -> Head:
    """Head of a directory's data. ValueError naming the file where it is missing or damaged."""
    file = path / f"{kind}.json"
    try:
        with refusing("it"):
            content = parse_json(read_text(file), "it")
            found: Head = require_format(content, f"stickslip {kind}", VERSION, f"a {kind}")
            if not (isinstance(found.get("definition"), dict) and found.get("digest")):
                raise RefusedError("it has no definition")
            if not 0 < int(found["cells"]) <= MOST_CELLS:
                raise RefusedError(f"it has {shown(found['cells'])} cells")
            return found
    except ValueError as error:
        raise ValueError(f"{file}: {error}; accepted: the directory of a {kind}") from error


def missing_cells(
    path: Path, kind: str, digest: str, count: int, rows: Callable[[int], int] | None = None
) -> list[int]:
    """Numbers of the cells that are not there; remains of killed processes are deleted.

    rows: of a cell. ValueError naming a file that is damaged or no cell.
    """
    (path / DATA).mkdir(exist_ok=True)
    there = set()
    for file in (path / DATA).iterdir():
        if is_remains(file.name, _CellNames()):
            file.unlink()
            continue
        found = CELL.fullmatch(file.name)
        if not found or int(found[1]) >= count:
            raise ValueError(f"{file} is no cell of the {kind} in {path}; accepted: its own alone")
        number = int(found[1])
        require_cell(file, number, digest, None if rows is None else rows(number))
        there.add(number)
    return [number for number in range(count) if number not in there]


def write_cell(path: Path, number: int, digest: str, table: pa.Table) -> None:
    """Write a cell atomically. OSError naming the file and what to do."""
    from pyarrow import parquet

    file, about = cell_path(path, number), json.dumps({"digest": digest, "cell": number}).encode()
    try:
        with writing(file) as to:
            schema = table.schema.metadata or {}
            marked = table.replace_schema_metadata({**schema, KEY: about})
            parquet.write_table(marked, to, compression="zstd")
    except OSError as error:
        raise OSError(
            error.errno,
            f"{file}: {error.strerror or error}; what was written before is complete: make room "
            "and continue with --resume",
        ) from error


def require_cell(file: Path, number: int, digest: str, rows: int | None = None) -> None:
    """Raise ValueError naming the file unless it is that cell of the store."""
    from pyarrow import parquet

    with _reading(file):
        found = parquet.read_metadata(file)
        if json.loads((found.metadata or {}).get(KEY, b"{}")) != {"digest": digest, "cell": number}:
            raise RefusedError("it belongs to another store, or another place in it")
        if rows is not None and found.num_rows != rows:
            raise RefusedError(f"it has {found.num_rows} rows, not {rows}")


def read_cell(file: Path, columns: list[str] | None = None) -> pa.Table:
    """A cell's table. ValueError naming a file that is damaged."""
    from pyarrow import parquet

    with _reading(file):
        return parquet.read_table(file, columns=columns)


def cell_files(path: Path, kind: str, *, partial: bool = False) -> list[Path]:
    """The cells' files in their order. ValueError naming one that is damaged or of another store,
    and where one is missing, unless partial, or all are."""
    head = read_head(path, kind)
    files = [cell_path(path, number) for number in range(int(head["cells"]))]
    there = {number: file for number, file in enumerate(files) if file.exists()}
    for number, file in there.items():
        require_cell(file, number, head["digest"])
    if not there or (len(there) < len(files) and not partial):
        raise ValueError(
            f"{path} holds {len(there)} of {len(files)} cells; accepted: a complete {kind} "
            "(continue it with --resume), or partial=True with at least one cell"
        )
    return list(there.values())


def versions(more: tuple[str, ...] = ()) -> dict[str, str]:
    """Versions of Python, the platform and packages. more: packages besides PACKAGES."""
    found = {"python": platform.python_version(), "platform": platform.platform()}
    for package in (*PACKAGES, *more):
        with suppress(PackageNotFoundError):
            found[package] = version(package)
    return found


@contextmanager
def _reading(file: Path) -> Iterator[None]:
    try:
        with refusing("it"):
            yield
    except ValueError as error:
        raise ValueError(
            f"{file}: {error}; accepted: a cell as it was written; move the file away, and "
            "--resume computes it again"
        ) from error


class _CellNames:
    """All names of cells' files."""

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and CELL.fullmatch(name) is not None


def _differing(one: Mapping[str, object], other: Mapping[str, object]) -> list[str]:
    """Entries that differ between two definitions."""
    found = []
    for name in sorted({*one, *other}):
        a, b = one.get(name), other.get(name)
        if isinstance(a, dict) and isinstance(b, dict):
            keys = sorted(str(key) for key in {*a, *b} if a.get(key) != b.get(key))
            found += [f"{name} {shown(key)}" for key in keys]
        elif a != b:
            plain = isinstance(a, int | str) and isinstance(b, int | str)
            found.append(f"{name} {a}, not {b}" if plain else name)
    return found or ["its entries do not match its digest"]
