"""Reading results that anybody may have written: checked whole, every failure named."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.foreign.reading import (
    LARGEST_TABLE,
    RefusedError,
    parse_json,
    read_bytes,
    refusing,
)
from stickslip.agents.optimisers.names import EVENTS, OUTCOMES
from stickslip.agents.optimisers.results import COLUMNS, SHORT, Run, runs_of_rows
from stickslip.dynamics.plain_checks import nearest, shown
from stickslip.optim.instances.catalogue import suite

if TYPE_CHECKING:
    import pyarrow as pa

    from stickslip.agents.foreign.reading import Json
    from stickslip.optim.instances.exports import Foreign

MOST_ROWS = 5_000_000
MOST = 1e300
"""Of a point's numbers, either way."""
BELOW_BOUND = 1e-6
"""How far a value may be below what is proved, in parts of it, and absolutely: roundings."""
ROW_WORDS = 300
CLOCK = 1e-5
"""How far seconds may fall from row to row: what reading a clock twice makes of one instant [s]."""


def read_results(*paths: str | Path) -> list[Run]:
    """Runs of tables (.parquet, .csv) and of races' directories, together.

    ValueError naming the file, the row and what is accepted: for damage, for columns that lack or
    hold something else, unknown ids, an instance of other numbers, evaluations that fall, values
    that rise or are below what is proved; and for runs that two files hold.
    """
    if not paths:
        raise ValueError("no file; accepted: one at least")
    found: dict[tuple[str, str, int], tuple[Path, Run]] = {}
    for path in map(Path, paths):
        for run in read_runs(path):
            if run.key in found:
                name, method, seed = run.key
                raise ValueError(
                    f"{path}: {method} on {name} with seed {seed} is also in {found[run.key][0]}; "
                    "accepted: each run once; give yours another method's name"
                )
            found[run.key] = path, run
    return [run for _, run in found.values()]


def read_runs(path: Path) -> list[Run]:
    """Runs of one table or directory, see `read_results`."""
    if path.is_dir():
        from stickslip.agents.optimisers.directory import task_files

        return [run for file in task_files(path) for run in read_runs(file)]
    try:
        with refusing("it"):
            rows = _rows(path)
            for number, row in enumerate(rows, start=1):
                _require_row(row, number)
            runs = runs_of_rows(rows)
            for run in runs:
                _require_run(run)
            return runs
    except ValueError as error:
        raise ValueError(
            f"{path}: {error}; accepted: a table as docs/optimisers.md has it, in .parquet or .csv"
        ) from error


def _rows(path: Path) -> list[dict[str, Foreign]]:
    """Rows with all columns, what a table lacks filled in."""
    import pyarrow as pa

    raw = read_bytes(path, LARGEST_TABLE)
    table = _parquet(raw) if path.suffix == ".parquet" else _csv(raw, path.suffix)
    if table.num_rows > MOST_ROWS:
        raise RefusedError(f"{table.num_rows} rows, at most {MOST_ROWS} are read")
    names = table.column_names
    for name, column in COLUMNS.items():
        if column.required and name not in names:
            raise RefusedError(
                f"no column {name!r}; its columns are {', '.join(names)[:ROW_WORDS]}"
            )
    for name in names:
        if name not in COLUMNS or names.count(name) > 1:
            raise RefusedError(f"column {shown(name)} is unknown or twice{nearest(name, COLUMNS)}")
    kinds = {"words": pa.string(), "count": pa.int64(), "number": pa.float64(), "bool": pa.bool_()}
    columns: dict[str, list[Foreign]] = {}
    for name, column in COLUMNS.items():
        if name not in names:
            columns[name] = [column.otherwise] * table.num_rows
            continue
        try:
            cells = table[name].cast(kinds[column.kind]).to_pylist()
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError) as error:
            raise RefusedError(f"column {name} does not hold {column.kind}s: {error}") from error
        empty = column.otherwise if column.kind in ("words", "bool") else None
        columns[name] = [empty if cell is None else cell for cell in cells]
    return [dict(zip(columns, cells, strict=True)) for cells in zip(*columns.values(), strict=True)]


def _parquet(raw: bytes) -> pa.Table:
    import pyarrow as pa
    from pyarrow import parquet

    file = parquet.ParquetFile(pa.BufferReader(raw))
    if file.metadata.num_rows > MOST_ROWS:
        raise RefusedError(f"{file.metadata.num_rows} rows, at most {MOST_ROWS} are read")
    return file.read(use_threads=False)


def _csv(raw: bytes, suffix: str) -> pa.Table:
    import pyarrow as pa
    from pyarrow import csv

    if suffix != ".csv":
        raise RefusedError(f"its name ends in {suffix!r}")
    words = [name for name, one in COLUMNS.items() if one.kind == "words"]
    kinds = {name: pa.string() for name in words}
    reading = csv.ReadOptions(use_threads=False)
    options = csv.ConvertOptions(
        column_types=kinds, null_values=["", "nan", "NaN"], strings_can_be_null=True
    )
    return csv.read_csv(pa.BufferReader(raw), read_options=reading, convert_options=options)


def _require_row(row: dict[str, Foreign], number: int) -> None:
    """Refuse a row by itself."""
    name = row["instance"]
    if name not in suite():
        raise RefusedError(
            f"row {number}: instance {shown(name)} is unknown{nearest(name, suite())}"
        )
    if not row["method"] or len(row["method"]) > 80:
        raise RefusedError(f"row {number}: method = {shown(row['method'])}, of 1 to 80 characters")
    for entry, known in (("event", EVENTS), ("outcome", OUTCOMES)):
        if row[entry] not in known:
            raise RefusedError(
                f"row {number}: {entry} = {shown(row[entry])} is none of {', '.join(known)}"
            )
    _require_point(row, number)
    for entry, column in COLUMNS.items():
        cell = row[entry]
        if column.kind == "count" and cell is None and column.required:
            raise RefusedError(f"row {number}: {entry} is empty")
        below = cell is not None and column.kind in ("count", "number") and cell < 0
        if below and entry != "value":
            raise RefusedError(f"row {number}: {entry} = {cell}, at least 0")
        if column.kind == "number" and cell is not None and np.isinf(cell):
            raise RefusedError(f"row {number}: {entry} = {cell}, a finite number or empty")


def _require_point(row: dict[str, Foreign], number: int) -> None:
    if not row["point"]:
        return
    n = suite()[row["instance"]].n
    found = parse_json(row["point"], f"row {number}: point")
    if not isinstance(found, list) or len(found) != n or not all(map(_is_number, found)):
        raise RefusedError(f"row {number}: point = {shown(row['point'])}, a list of {n} numbers")


def _is_number(value: Json) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < MOST


def _require_run(run: Run) -> None:
    """Refuse rows that do not belong together, or say what cannot be."""
    what, one = f"{run.method} on {run.instance} with seed {run.seed}", suite()[run.instance]
    if run.events.count("end") > 1:
        raise RefusedError(f"{what} ends twice, or is there twice")
    if np.any(np.diff(run.evaluations) < 0) or np.any(np.diff(run.seconds) < -CLOCK):
        raise RefusedError(f"{what}: evaluations or seconds fall from row to row")
    known = run.values[np.isfinite(run.values)]
    if np.any(np.diff(known) > 0):
        raise RefusedError(f"{what}: the best value rises from row to row")
    bound = one.lower_bound
    if bound is not None and len(known):
        room = BELOW_BOUND * (1 + abs(bound))
        if known[-1] < bound - room:
            raise RefusedError(f"{what}: value {known[-1]:g} is below the proved bound {bound:g}")
    recorded = one.known
    if run.digest and recorded is not None and not recorded.digest.startswith(run.digest[:SHORT]):
        raise RefusedError(f"{what}: digest {run.digest} is not that of the instance here")
