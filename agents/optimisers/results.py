"""Runs, and the table they are kept in: a row for each event, Parquet or CSV."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.sweeps.files.parquet import ABOUT, write_chunk
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    import pyarrow as pa
    from jaxtyping import Float, Int

    Cell = str | int | float | bool | None


class Column(NamedTuple):
    """A column of the table: its kind ("words", "count", "number", "bool"), unit and meaning; what
    stands for it in a table that lacks it, or REQUIRED."""

    kind: str
    unit: str
    meaning: str
    otherwise: Cell = None
    required: bool = False


COUNTED = {
    "values": "points whose value was computed",
    "gradients": "points whose gradient was computed",
    "batches": "calls that computed many values",
    "clipped": "points out of bounds that were moved to the nearest inside",
    "refused": "points out of bounds that were refused",
    "not_numbers": "points that held no finite numbers",
}
COLUMNS: dict[str, Column] = {
    "instance": Column("words", "-", "id of the suite", required=True),
    "method": Column("words", "-", "name of the optimiser", required=True),
    "seed": Column("count", "-", "of the run: its draws and where it begins", required=True),
    "event": Column("words", "-", "what the row tells of: violation, value or end", "value"),
    "evaluations": Column("count", "-", "values and gradients by then", required=True),
    "seconds": Column("number", "s", "processor time by then", None),
    "value": Column("number", "goal's", "best feasible value by then; none: empty. Noisy instances:"
                    " its mean over other draws. Two goals: missing share of the known front's"
                    " hypervolume", required=True),
    "violation": Column("number", "-", "least summed violation of scaled constraints by then", 0.0),
    "outcome": Column("words", "-", "of the run: spent, ended, raised, timed out, died", "ended"),
    "message": Column("words", "-", "of the run, where it failed", ""),
    "inside": Column("bool", "-", "whether it works on the problem itself, so that its evaluations"
                     " say nothing", False),
    "budget": Column("count", "-", "evaluations the run was allowed", None),
    "limit_seconds": Column("number", "s", "processor time the run was allowed", None),
    **{name: Column("count", "-", f"of the run: {words}", 0) for name, words in COUNTED.items()},
    "wall_seconds": Column("number", "s", "time that the run took on the clock", None),
    "digest": Column("words", "-", "of the instance, first 12 digits", ""),
    "point": Column("words", "-", "at the end: the free numbers that the value is of, as a list of"
                    " JSON; two goals: none", ""),
}  # fmt: skip
"""The table, in its order."""
DIGITS, SHORT = 6, 12
"""Of seconds after the point, and of digests."""


@dataclass(frozen=True)
class Run:
    """One run of a method on an instance with a seed; COLUMNS say what its entries are.

    events, evaluations, seconds, values, violations [rows]: one for each row, the last of the end.
    point: None where it is not known.
    """

    instance: str
    method: str
    seed: int
    outcome: str
    message: str
    inside: bool
    budget: int | None
    limit_seconds: float | None
    counts: Mapping[str, int]
    wall_seconds: float
    digest: str
    events: tuple[str, ...] = field(repr=False)
    evaluations: Int[np.ndarray, "rows"] = field(repr=False)
    seconds: Float[np.ndarray, "rows"] = field(repr=False)
    values: Float[np.ndarray, "rows"] = field(repr=False)
    violations: Float[np.ndarray, "rows"] = field(repr=False)
    point: Float[np.ndarray, "n"] | None = field(repr=False, default=None)

    @property
    def key(self) -> tuple[str, str, int]:
        """Instance, method and seed: each once in a table."""
        return self.instance, self.method, self.seed

    @property
    def best(self) -> float:
        """The best feasible value; NaN where there is none."""
        return float(self.values[-1])

    def rows(self) -> list[dict[str, Cell]]:
        """Its rows of the table."""
        own: dict[str, Cell] = {
            name: getattr(self, name)
            for name in ("instance", "method", "seed", "outcome", "message", "inside", "budget")
        }
        own |= {name: _number(getattr(self, name)) for name in ("limit_seconds", "wall_seconds")}
        own |= {"digest": self.digest[:SHORT], **{name: self.counts[name] for name in COUNTED}}
        point = "" if self.point is None else json.dumps(self.point.tolist())
        found = []
        for i, kind in enumerate(self.events):
            at: dict[str, Cell] = {
                "event": kind,
                "evaluations": int(self.evaluations[i]),
                "seconds": _number(round(float(self.seconds[i]), DIGITS)),
                "value": _number(float(self.values[i])),
                "violation": _number(float(self.violations[i])),
                "point": point if kind == "end" else "",
            }
            found.append({name: (own | at)[name] for name in COLUMNS})
        return found


def _number(value: float | None) -> float | None:
    return None if value is None or not np.isfinite(value) else float(value)


def table_of(runs: Iterable[Run], about: Mapping[str, object]) -> pa.Table:
    """The runs as an Arrow table, columns with unit and meaning; about: for its metadata."""
    import pyarrow as pa

    kinds = {
        "words": pa.dictionary(pa.int32(), pa.string()),
        "count": pa.int64(),
        "number": pa.float64(),
        "bool": pa.bool_(),
    }
    rows = [row for run in runs for row in run.rows()]
    fields = [
        pa.field(name, kinds[one.kind], metadata={"unit": one.unit, "meaning": one.meaning})
        for name, one in COLUMNS.items()
    ]
    schema = pa.schema(fields, metadata={ABOUT: json.dumps(dict(about)).encode()})
    arrays = []
    for name, one in COLUMNS.items():
        cells = [row[name] for row in rows]
        array = pa.array(cells, pa.string() if one.kind == "words" else kinds[one.kind])
        arrays.append(array.dictionary_encode() if one.kind == "words" else array)
    return pa.Table.from_arrays(arrays, schema=schema)


def write_results(
    runs: Sequence[Run], path: str | Path, about: Mapping[str, object] | None = None
) -> Path:
    """Write a table, as .parquet or .csv; ValueError for another ending or a file that is there."""
    path = Path(path)
    if path.suffix not in (".parquet", ".csv"):
        raise ValueError(f"{path}; accepted: a file that ends in .parquet or .csv")
    if path.exists():
        raise ValueError(f"{path} exists; accepted: a new path")
    if path.suffix == ".parquet":
        write_chunk(path, table_of(runs, about or {}))
        return path
    text = io.StringIO()
    writer = csv.DictWriter(text, list(COLUMNS), lineterminator="\n")
    writer.writeheader()
    for run in runs:
        writer.writerows(
            {name: "" if cell is None else cell for name, cell in row.items()} for row in run.rows()
        )
    return write_whole(path, text.getvalue(), overwrite=False)


def runs_of_rows(rows: Sequence[Mapping[str, Cell]]) -> list[Run]:
    """Runs from rows that were checked, in the order of the table."""
    by_run = sorted(enumerate(rows), key=lambda one: (*_key(one[1]), one[0]))
    found = []
    for _, group in groupby(by_run, key=lambda one: _key(one[1])):
        own = [row for _, row in group]
        last, events = own[-1], [str(row["event"]) for row in own]
        if events[-1] != "end":
            own, events = [*own, last], [*events, "end"]
        limit, wall = (_float(last[name]) for name in ("limit_seconds", "wall_seconds"))
        found.append(
            Run(
                *_key(last),
                str(last["outcome"]),
                str(last["message"]),
                bool(last["inside"]),
                None if last["budget"] is None else int(last["budget"]),
                None if np.isnan(limit) else limit,
                {name: int(last[name] or 0) for name in COUNTED},
                wall,
                str(last["digest"]),
                tuple(events),
                np.array([int(row["evaluations"] or 0) for row in own], np.int64),
                *(
                    np.array([_float(row[name]) for row in own])
                    for name in ("seconds", "value", "violation")
                ),
                point=_point(str(last["point"])),
            )
        )
    return found


def _key(row: Mapping[str, Cell]) -> tuple[str, str, int]:
    return str(row["instance"]), str(row["method"]), int(row["seed"] or 0)


def _point(text: str) -> np.ndarray | None:
    return np.array(json.loads(text), float) if text else None


def _float(cell: Cell) -> float:
    return np.nan if cell is None else float(cell)
