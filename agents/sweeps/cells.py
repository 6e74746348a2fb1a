"""Numbered cells of work: computed by an executor, kept as a Parquet data set.

A directory holds `data/cell-000000.parquet` and so on, and a JSON file that defines them. Only the
calling process writes, atomically; a run resumes with the missing cells. For sweeps and races."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from concurrent import futures
from concurrent.futures import BrokenExecutor, CancelledError, Future
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from stickslip.agents.policy.file import installed
from stickslip.agents.untrusted import RefusedError, parse_json, read_text, reading, require_format
from stickslip.dynamics.checks import shown
from stickslip.records.files import PARTIAL, is_remains, write_whole, writing
from stickslip.records.signals import StoppedError
from stickslip.records.table import json_text

if TYPE_CHECKING:
    import pyarrow as pa

Found = TypeVar("Found")
Head: TypeAlias = "dict[str, Any]"
"""The JSON file of a directory."""
VERSION, MOST_CELLS = 3, 10**6
DATA, KEY, CELL = "data", b"stickslip", re.compile(r"cell-(\d{6})\.parquet")
POLL, WINDOW = 0.2, 1024
"""Longest interval at which `stop` is polled [s]; cells submitted at once."""
CELL_FILE = "a cell as it was written; move the file away, and --resume computes it again"
LOST = "the workers were lost; what was written stays: start others, and continue with --resume"


def run_cells(
    submit: Callable[[int], Future[Found]],
    keep: Callable[[int, Future[Found]], None],
    todo: Sequence[int],
    stop: Callable[[], bool],
    here: bool = False,
) -> None:
    """Submit cells to an executor and keep each as it is done, by its number and future.

    The first error ends the run; kept cells stay. StoppedError where `stop`, polled after the cells
    that are done, returns True; OSError where the executor has lost its workers. here: the executor
    waits at its end for the cells that it has begun, so they are kept, too.
    """
    left, running = iter(todo), {}
    try:
        while True:
            for number in islice(left, WINDOW - len(running)):
                running[submit(number)] = number
            if not running:
                return
            done, _ = futures.wait(running, POLL, futures.FIRST_COMPLETED)
            for one in done:
                keep(running.pop(one), one)
            if stop():
                begun = [one for one in running if not one.cancel() and here]
                for one in futures.as_completed(begun):
                    keep(running.pop(one), one)
                raise StoppedError
    except (CancelledError, BrokenExecutor) as error:
        raise OSError(LOST) from error
    finally:
        for one in running:
            one.cancel()


def open_store(path: Path, kind: str, content: Head, resume: bool) -> Head:
    """Create the directory of a "sweep" or "race", or resume the one there; return its head.

    content: of the head: its definition, the number of cells and what else is to be kept.
    ValueError where it holds something else, another definition or, unless resume, anything.
    """
    head, definition = f"{kind}.json", content["definition"]
    held = [one.name for one in path.iterdir() if not is_remains(one.name, (head,))]
    if held and head not in held:
        names = ", ".join(sorted(held)[:5])
        raise ValueError(f"{path} holds {names}, but no {kind}; accepted: a new directory")
    if held and not resume:
        accepted = f"a new directory, or --resume to continue the {kind} in it"
        raise ValueError(f"{path} exists and is not empty; accepted: {accepted}")
    if held:
        found = read_head(path, kind)
        if found["digest"] != digest_of(definition):
            differing = _differing(found["definition"], definition) or "digest"
            raise ValueError(
                f"{path} was begun with another definition: {differing}; accepted: to resume "
                "without changing it, or a new directory"
            )
        return found
    if content["cells"] > MOST_CELLS:
        raise ValueError(f"{content['cells']} cells; accepted: up to {MOST_CELLS:,}, larger ones")
    content = {
        "format": f"stickslip {kind}",
        "version": VERSION,
        "digest": digest_of(definition),
        **content,
        "begun": datetime.now(UTC).isoformat(timespec="seconds"),
        "versions": installed(),
    }
    write_whole(path / head, json_text(content))
    return content


def digest_of(definition: Mapping[str, object]) -> str:
    """SHA-256 of a definition."""
    return hashlib.sha256(json.dumps(definition, sort_keys=True).encode()).hexdigest()


def read_head(path: Path, kind: str) -> Head:
    """Head of a directory. ValueError naming the file where it is missing or damaged."""
    file = path / f"{kind}.json"
    with reading(file, f"the directory of a {kind}"):
        content = parse_json(read_text(file), "it")
        found: Head = require_format(content, f"stickslip {kind}", VERSION, f"a {kind}")
        if not (isinstance(found.get("definition"), dict) and found.get("digest")):
            raise RefusedError("it has no definition")
        if not 0 < int(found["cells"]) <= MOST_CELLS:
            raise RefusedError(f"it has {shown(found['cells'])} cells")
        return found


def cell_files(path: Path, kind: str) -> dict[int, Path]:
    """The checked files of the cells that are there, by number.

    ValueError naming a file that is damaged, of another directory or no cell.
    """
    from pyarrow import parquet

    head, found = read_head(path, kind), {}
    for file in sorted((path / DATA).glob("cell-*")):
        name = CELL.fullmatch(file.name)
        if not name or int(name[1]) >= int(head["cells"]):
            raise ValueError(f"{file} is no cell of the {kind} in {path}; accepted: its own alone")
        found[int(name[1])] = file
        with reading(file, CELL_FILE):
            about = (parquet.read_metadata(file).metadata or {}).get(KEY, b"{}")
            if json.loads(about) != _key(head, int(name[1])):
                raise RefusedError("it belongs to another store, or another place in it")
    return found


def missing_cells(path: Path, kind: str) -> list[int]:
    """Numbers of the cells that are not there; remains of killed processes are deleted."""
    (path / DATA).mkdir(exist_ok=True)
    for file in (path / DATA).glob(f".cell-*{PARTIAL}"):
        file.unlink()
    there, count = cell_files(path, kind), int(read_head(path, kind)["cells"])
    return [number for number in range(count) if number not in there]


def write_cell(path: Path, number: int, head: Head, table: pa.Table) -> None:
    """Write a cell atomically. head: of the directory. OSError naming the file and what to do."""
    from pyarrow import parquet

    file = path / DATA / f"cell-{number:06d}.parquet"
    about = json.dumps(_key(head, number)).encode()
    try:
        with writing(file) as to:
            marked = table.replace_schema_metadata({**(table.schema.metadata or {}), KEY: about})
            parquet.write_table(marked, to, compression="zstd", write_page_checksum=True)
    except OSError as error:
        raise OSError(
            error.errno,
            f"{file}: {error.strerror or error}; what was written before is complete: make room "
            "and continue with --resume",
        ) from error


def _key(head: Head, number: int) -> dict[str, object]:
    return {"digest": head["digest"], "cells": head["cells"], "cell": number}


def _differing(one: Mapping[str, object], other: Mapping[str, object]) -> str:
    """Entries that differ between two definitions."""
    names = [name for name in sorted({*one, *other}) if one.get(name) != other.get(name)]
    plain = {name for name in names if isinstance(one.get(name), int | str)}
    return ", ".join(f"{n} {one[n]}, not {other.get(n)}" if n in plain else n for n in names)
