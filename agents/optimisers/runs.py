"""Runs, and the table they are kept in, as Parquet or CSV: a row for each improvement."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.agents.sweeps.cells import cell_files
from stickslip.agents.untrusted import (
    LARGEST_TABLE,
    RefusedError,
    parse_json,
    read_bytes,
    refusing,
)
from stickslip.dynamics.plain_checks import nearest, shown
from stickslip.optim.instances.catalogue import suite
from stickslip.records.files import writing

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    import pyarrow as pa
    from jaxtyping import Float, Int

    Cell = str | int | float | bool | None
    Row = Mapping[str, Any]

OUTCOMES = ("spent", "ended", "raised", "timed out", "died")
"""The budget ended it, it ended by itself, it raised, it was killed, its process ended."""
FAILED = OUTCOMES[2:]
REQUIRED = {
    "instance": ("string", "id of the suite"),
    "method": ("string", "name of the optimiser"),
    "seed": ("int64", "of the run"),
    "evaluations": ("int64", "values and gradients so far"),
    "value": ("float64", "best feasible value so far"),
}
COUNTED = {
    "values": ("int64", "points whose value was computed"),
    "gradients": ("int64", "points whose gradient was computed"),
    "batches": ("int64", "calls that computed many values"),
    "clipped": ("int64", "points out of bounds that were moved to the nearest inside"),
    "refused": ("int64", "points out of bounds that were refused"),
    "not_numbers": ("int64", "points that held no finite numbers"),
}
COLUMNS = {
    **REQUIRED,
    "seconds": ("float64", "processor time so far [s]"),
    "outcome": ("string", ", ".join(OUTCOMES)),
    "message": ("string", "why the run failed"),
    "inside": ("bool_", "whether the method works on the problem itself"),
    **COUNTED,
    "digest": ("string", "of the instance, 12 digits"),
    "point": ("string", "at the end: free numbers of the value, as JSON"),
}
"""Type and meaning of each column; those that are not REQUIRED may be empty or missing."""
DIGITS, SHORT = 6, 12
"""Digits of seconds after the point, and of digests."""
MOST_ROWS, LARGEST = 5_000_000, 1e300
BELOW_BOUND, CLOCK = 1e-6, 1e-5
"""Tolerance of values below a proved bound, and of seconds that decrease: roundings."""


@dataclass(frozen=True)
class Run:
    """One run of a method on an instance with a seed; COLUMNS say what its entries are.

    evaluations, seconds, values [rows]: one for each improvement, the last of the end.
    """

    instance: str
    method: str
    seed: int
    outcome: str
    message: str
    inside: bool
    counts: Mapping[str, int]
    digest: str
    evaluations: Int[np.ndarray, "rows"] = field(repr=False)
    seconds: Float[np.ndarray, "rows"] = field(repr=False)
    values: Float[np.ndarray, "rows"] = field(repr=False)
    point: Float[np.ndarray, "n"] | None = field(repr=False, default=None)

    @property
    def key(self) -> tuple[str, str, int]:
        """Instance, method and seed: each once in a table."""
        return self.instance, self.method, self.seed

    @property
    def best(self) -> float:
        """The best feasible value; NaN where there is none."""
        return float(self.values[-1])

    def rows(self) -> list[Row]:
        """Its rows of the table."""
        own = {name: getattr(self, name) for name in COLUMNS if hasattr(self, name)}
        own |= {"digest": self.digest[:SHORT], **{name: self.counts[name] for name in COUNTED}}
        point = "" if self.point is None else json.dumps(self.point.tolist())
        found = []
        for i, count in enumerate(self.evaluations):
            at = own | {
                "evaluations": int(count),
                "seconds": round(float(self.seconds[i]), DIGITS),
                "value": float(self.values[i]),
                "point": point if i == len(self.values) - 1 else "",
            }
            found.append({name: _finite(at[name]) for name in COLUMNS})
        return found


def _finite(cell: Cell) -> Cell:
    return None if isinstance(cell, float) and not np.isfinite(cell) else cell


def table_of(runs: Iterable[Run]) -> pa.Table:
    """The runs as an Arrow table, columns with their meaning."""
    import pyarrow as pa

    fields = [
        pa.field(name, getattr(pa, kind)(), metadata={"meaning": meaning})
        for name, (kind, meaning) in COLUMNS.items()
    ]
    rows = [dict(row) for run in runs for row in run.rows()]
    return pa.Table.from_pylist(rows, schema=pa.schema(fields))


def write_results(runs: Sequence[Run], path: str | Path) -> Path:
    """Write a table, as .parquet or .csv; ValueError for another ending or a file that is there."""
    from pyarrow import csv, parquet

    path, table = Path(path), table_of(runs)
    if path.suffix not in (".parquet", ".csv"):
        raise ValueError(f"{path}; accepted: a file that ends in .parquet or .csv")
    with writing(path, overwrite=False) as to:
        if path.suffix == ".parquet":
            parquet.write_table(table, to, compression="zstd")
        else:
            csv.write_csv(table, to)
    return path


def read_results(*paths: str | Path) -> list[Run]:
    """Runs of tables (.parquet, .csv) and of races' directories, together.

    ValueError naming the file, the row and what is accepted: for damage, missing and unknown
    columns, unknown ids, instances with other numbers, evaluations that fall, values that rise or
    lie below what is proved; and for runs that two files hold.
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
        return [run for one in cell_files(path, "race").values() for run in read_runs(one)]
    try:
        with refusing("it"):
            rows = _rows(path)
            for number, row in enumerate(rows, start=1):
                try:
                    _require_row(row)
                except RefusedError as error:
                    raise RefusedError(f"row {number}: {error}") from error
            by_run = sorted(enumerate(rows), key=lambda one: (*_key(one[1]), one[0]))
            groups = groupby((row for _, row in by_run), key=_key)
            runs = [_run_of_rows(list(group)) for _, group in groups]
            for run in runs:
                _require_run(run)
            return runs
    except ValueError as error:
        raise ValueError(
            f"{path}: {error}; accepted: a table as docs/optimisers.md has it, in .parquet or .csv"
        ) from error


def _rows(path: Path) -> list[Row]:
    """Rows with all columns, None where one is empty or missing."""
    import pyarrow as pa

    table = _table(read_bytes(path, LARGEST_TABLE), path.suffix)
    names = table.column_names
    if missing := [name for name in REQUIRED if name not in names]:
        raise RefusedError(f"no column {missing[0]!r}; its columns are {', '.join(names)[:300]}")
    columns: dict[str, list[object]] = {name: [None] * table.num_rows for name in COLUMNS}
    for name in names:
        if name not in COLUMNS or names.count(name) > 1:
            raise RefusedError(f"column {shown(name)} is unknown or twice{nearest(name, COLUMNS)}")
        kind = COLUMNS[name][0]
        try:
            columns[name] = table[name].cast(getattr(pa, kind)()).to_pylist()
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError) as error:
            raise RefusedError(f"column {name} does not hold {kind}: {error}") from error
    return [dict(zip(columns, cells, strict=True)) for cells in zip(*columns.values(), strict=True)]


def _table(raw: bytes, suffix: str) -> pa.Table:
    import pyarrow as pa
    from pyarrow import csv, parquet

    if suffix == ".parquet":
        file = parquet.ParquetFile(pa.BufferReader(raw))
        count, read = file.metadata.num_rows, partial(file.read, use_threads=False)
    elif suffix == ".csv":
        words = {name: pa.string() for name, (kind, _) in COLUMNS.items() if kind == "string"}
        options = csv.ConvertOptions(
            column_types=words, null_values=["", "nan", "NaN"], strings_can_be_null=True
        )
        count, threads = raw.count(b"\n"), csv.ReadOptions(use_threads=False)
        read = partial(csv.read_csv, pa.BufferReader(raw), threads, convert_options=options)
    else:
        raise RefusedError(f"its name ends in {suffix!r}")
    if count > MOST_ROWS:
        raise RefusedError(f"{count} rows, at most {MOST_ROWS} are read")
    return read()


def _require_row(row: Row) -> None:
    """Refuse a row by itself."""
    name, outcome = row["instance"], row["outcome"] or OUTCOMES[1]
    if name not in suite():
        raise RefusedError(f"instance {shown(name)} is unknown{nearest(str(name), suite())}")
    if not row["method"] or len(row["method"]) > 80:
        raise RefusedError(f"method = {shown(row['method'])}, of 1 to 80 characters")
    if outcome not in OUTCOMES:
        raise RefusedError(f"outcome = {shown(outcome)} is none of {', '.join(OUTCOMES)}")
    if row["point"]:
        n, found = suite()[name].n, parse_json(row["point"], "point")
        if not isinstance(found, list) or len(found) != n or not all(map(_is_number, found)):
            raise RefusedError(f"point = {shown(row['point'])}, a list of {n} numbers")
    for entry in ("seed", "evaluations", "value", "seconds", *COUNTED):
        cell = row[entry]
        if cell is None and entry in ("seed", "evaluations"):
            raise RefusedError(f"{entry} is empty")
        if cell is not None and np.isinf(cell):
            raise RefusedError(f"{entry} = {cell}, a finite number or empty")
        if cell is not None and cell < 0 and entry != "value":
            raise RefusedError(f"{entry} = {cell}, at least 0")


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < LARGEST


def _require_run(run: Run) -> None:
    """Refuse rows that contradict each other or what is known of the instance."""
    what, one = f"{run.method} on {run.instance} with seed {run.seed}", suite()[run.instance]
    if np.any(np.diff(run.evaluations) < 0) or np.any(np.diff(run.seconds) < -CLOCK):
        raise RefusedError(f"{what}: evaluations or seconds fall from row to row")
    known, bound = run.values[np.isfinite(run.values)], one.lower_bound
    if np.any(np.diff(known) > 0):
        raise RefusedError(f"{what}: the best value rises from row to row")
    if bound is not None and len(known) and known[-1] < bound - BELOW_BOUND * (1 + abs(bound)):
        raise RefusedError(f"{what}: value {known[-1]:g} is below the proved bound {bound:g}")
    if run.digest and one.known and not one.known.digest.startswith(run.digest[:SHORT]):
        raise RefusedError(f"{what}: digest {run.digest} is not that of the instance here")


def _run_of_rows(rows: list[Row]) -> Run:
    """A run from its checked rows, in their order."""
    last = rows[-1]
    instance, method, seed = _key(last)
    return Run(
        instance=instance,
        method=method,
        seed=seed,
        outcome=last["outcome"] or OUTCOMES[1],
        message=last["message"] or "",
        inside=bool(last["inside"]),
        counts={name: int(last[name] or 0) for name in COUNTED},
        digest=last["digest"] or "",
        evaluations=np.array([row["evaluations"] for row in rows], np.int64),
        seconds=np.array([_number(row["seconds"]) for row in rows]),
        values=np.array([_number(row["value"]) for row in rows]),
        point=np.array(json.loads(last["point"]), float) if last["point"] else None,
    )


def _key(row: Row) -> tuple[str, str, int]:
    return row["instance"], row["method"], int(row["seed"])


def _number(cell: float | None) -> float:
    return np.nan if cell is None else float(cell)
