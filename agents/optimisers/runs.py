"""Runs, and the table they are kept in, as Parquet or CSV: a row for each improvement."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.agents.sweeps.cells import cell_files
from stickslip.agents.untrusted import (
    LARGEST_TABLE,
    RefusedError,
    Rule,
    parse_json,
    read_bytes,
    reading,
)
from stickslip.dynamics.checks import nearest, shown
from stickslip.optim.instances.instance import suite
from stickslip.records.files import writing

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    import pyarrow as pa
    from jaxtyping import Float, Int

    Row = dict[str, Any]

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
RULES = {
    "seed": Rule(int, "", low=0),
    "evaluations": Rule(int, "", low=0),
    "value": Rule(float, "", optional=True),
    "seconds": Rule(float, "", low=0, optional=True),
    "outcome": Rule(str, "", choices=OUTCOMES, optional=True),
    **{name: Rule(int, "", low=0, optional=True) for name in COUNTED},
}
DIGITS, SHORT = 6, 12
"""Digits of seconds after the point, and of digests."""
MOST_ROWS = 5_000_000
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
        own |= {"digest": self.digest[:SHORT], **self.counts}
        found = []
        for count, seconds, value in zip(self.evaluations, self.seconds, self.values, strict=True):
            at = {"evaluations": int(count), "seconds": _cell(round(float(seconds), DIGITS))}
            found.append({**own, **at, "value": _cell(float(value)), "point": ""})
        found[-1]["point"] = "" if self.point is None else json.dumps(self.point.tolist())
        return found


def _cell(number: float) -> float | None:
    """The number, None for one that is not finite."""
    return number if np.isfinite(number) else None


def table_of(runs: Iterable[Run]) -> pa.Table:
    """The runs as an Arrow table, columns with their meaning."""
    import pyarrow as pa

    fields = [
        pa.field(name, getattr(pa, kind)(), metadata={"meaning": meaning})
        for name, (kind, meaning) in COLUMNS.items()
    ]
    return pa.Table.from_pylist([row for run in runs for row in run.rows()], pa.schema(fields))


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
    with reading(path, "a table as docs/suite.md has it, in .parquet or .csv"):
        rows = _rows(path)
        for number, row in enumerate(rows, start=1):
            try:
                _require_row(row)
            except ValueError as error:
                raise RefusedError(f"row {number}: {error}") from error
        by_run = groupby(sorted(rows, key=_key), key=_key)  # rows of a run keep their order
        return [_run_of_rows(list(group)) for _, group in by_run]


def _rows(path: Path) -> list[Row]:
    """Rows with all columns, None where one is empty or missing."""
    import pyarrow as pa

    table = _table(read_bytes(path, LARGEST_TABLE), path.suffix)
    names = table.column_names
    if missing := [name for name in REQUIRED if name not in names]:
        raise RefusedError(f"no column {missing[0]!r}; its columns are {', '.join(names)[:300]}")
    if unknown := [name for name in names if name not in COLUMNS]:
        raise RefusedError(f"column {shown(unknown[0])} is unknown{nearest(unknown[0], COLUMNS)}")
    columns = {}
    for name, (kind, _) in COLUMNS.items():
        column = table[name] if name in names else pa.nulls(table.num_rows)
        try:
            columns[name] = column.cast(getattr(pa, kind)())
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError) as error:
            raise RefusedError(f"column {name} does not hold {kind}: {error}") from error
    return pa.table(columns).to_pylist()


def _table(raw: bytes, suffix: str) -> pa.Table:
    import pyarrow as pa
    from pyarrow import csv, parquet

    if suffix == ".parquet":
        file = parquet.ParquetFile(pa.BufferReader(raw))
        if file.metadata.num_rows > MOST_ROWS:
            raise RefusedError(f"{file.metadata.num_rows} rows, at most {MOST_ROWS} are read")
        return file.read(use_threads=False)
    if suffix != ".csv":
        raise RefusedError(f"its name ends in {suffix!r}")
    words = {name: pa.string() for name, (kind, _) in COLUMNS.items() if kind == "string"}
    options = csv.ConvertOptions(
        column_types=words, null_values=["", "nan", "NaN"], strings_can_be_null=True
    )
    threads = csv.ReadOptions(use_threads=False)
    return csv.read_csv(pa.BufferReader(raw), threads, convert_options=options)


def _require_row(row: Row) -> None:
    """Refuse a row by itself."""
    name = row["instance"]
    if name not in suite():
        raise RefusedError(f"instance {shown(name)} is unknown{nearest(str(name), suite())}")
    if not row["method"] or len(row["method"]) > 80:
        raise RefusedError(f"method = {shown(row['method'])}, of 1 to 80 characters")
    for entry, rule in RULES.items():
        rule.require(entry, row[entry])
    if row["point"]:
        n, found = suite()[name].n, parse_json(row["point"], "point")
        kinds = [type(one) for one in found] if isinstance(found, list) else []
        if len(kinds) != n or not set(kinds) <= {int, float}:
            raise RefusedError(f"point = {shown(row['point'])}, a list of {n} numbers")


def _run_of_rows(rows: list[Row]) -> Run:
    """A run from its checked rows, in their order; refuses rows that contradict each other or what
    is known of the instance."""
    last = rows[-1]
    run = Run(
        instance=last["instance"],
        method=last["method"],
        seed=int(last["seed"]),
        outcome=last["outcome"] or OUTCOMES[1],
        message=last["message"] or "",
        inside=bool(last["inside"]),
        counts={name: int(last[name] or 0) for name in COUNTED},
        digest=last["digest"] or "",
        evaluations=np.array([row["evaluations"] for row in rows], np.int64),
        seconds=np.array([row["seconds"] for row in rows], float),
        values=np.array([row["value"] for row in rows], float),
        point=np.array(json.loads(last["point"]), float) if last["point"] else None,
    )
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
    return run


def _key(row: Row) -> tuple[str, str, int]:
    return row["instance"], row["method"], int(row["seed"])
