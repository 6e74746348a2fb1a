"""A table that grows while a run goes on, as CSV, and that a killed run can go on with."""

from __future__ import annotations

import csv
import io
import math
from typing import TYPE_CHECKING

from stickslip.agents.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

KEY = "timesteps"


class MetricsFile:
    """Rows in order of their `timesteps`, each on the disk once `append` returns.

    Opened at `upto`, rows past it are dropped, as is a last line that was cut short: what is
    written after a resumption follows on what the checkpoint knew. Numbers that are not finite are
    left empty.
    """

    def __init__(self, path: Path, columns: tuple[str, ...], upto: int = 0):
        self.path, self.columns = path, (KEY, *columns)
        lines = [self.columns]
        if path.exists():
            lines += [tuple(row.values()) for row in read_rows(path) if int(row[KEY]) <= upto]
        write_whole(path, "".join(map(_line, lines)))

    def append(self, timesteps: int, values: Mapping[str, float]) -> None:
        """Add a row; columns without a value stay empty."""
        row = [values.get(name, math.nan) for name in self.columns[1:]]
        with self.path.open("a", encoding="utf-8", newline="") as file:
            file.write(_line([timesteps, *(_number(value) for value in row)]))


def read_rows(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV file by column; lines of another length than the head's are left out.

    A line without its end is one that was being written.
    """
    text = path.read_text(encoding="utf-8")
    whole = text[: text.rfind("\n") + 1]
    head, *rows = list(csv.reader(io.StringIO(whole))) or [[]]
    return [dict(zip(head, row, strict=True)) for row in rows if len(row) == len(head)]


def read_columns(path: Path) -> dict[str, list[float]]:
    """The columns of a CSV file as numbers, NaN where empty; none if there is no file."""
    rows = read_rows(path) if path.exists() else []
    names = rows[0].keys() if rows else ()
    return {name: [float(row[name] or "nan") for row in rows] for name in names}


def _number(value: float) -> str:
    value = float(value)
    return f"{value:.7g}" if math.isfinite(value) else ""


def _line(cells) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue()
