"""Logs of a run: tables as CSV, and TensorBoard's files; both go on after a kill."""

from __future__ import annotations

import csv
import io
import math
import os
import socket
import time
from typing import TYPE_CHECKING, Any

from stickslip.agents.untrusted import LARGEST_TABLE, RefusedError, read_text, refusing
from stickslip.dynamics.checks import shown
from stickslip.records.files import write_whole
from stickslip.records.table import cell_text, csv_line

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

KEY = "timesteps"


class MetricsFile:
    """Rows in order of their `timesteps`, each on the disk once `append` returns.

    Rows past `upto` are dropped when it is opened, as is a last line that was cut short. Numbers
    that are not finite are left empty. ValueError for a file of other columns or of no numbers.
    """

    def __init__(self, path: Path, columns: tuple[str, ...], upto: int = 0):
        self.path, self.columns = path, (KEY, *columns)
        lines = [self.columns]
        if path.exists():
            rows = read_rows(path)
            if rows and tuple(rows[0]) != self.columns:
                raise ValueError(
                    f"{path}: its columns are {shown(list(rows[0]))}; accepted: those of this "
                    f"run, {', '.join(self.columns)}"
                )
            lines += [tuple(row.values()) for row in rows if int(row[KEY]) <= upto]
        write_whole(path, "".join(map(csv_line, lines)))

    def append(self, timesteps: int, values: Mapping[str, float]) -> None:
        """Add a row; columns without a value stay empty."""
        row = [values.get(name, math.nan) for name in self.columns[1:]]
        with self.path.open("a", encoding="utf-8", newline="") as file:
            file.write(csv_line([timesteps, *(_number(value) for value in row)]))


def read_rows(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV file by column; lines of another length than the head's are left out.

    A line without its end is one that was being written. ValueError, naming the file, unless every
    cell is empty or a number and the first of each row a whole one.
    """
    try:
        with refusing("the table"):
            text = read_text(path, LARGEST_TABLE)
            whole = text[: text.rfind("\n") + 1]
            head, *rows = list(csv.reader(io.StringIO(whole))) or [[]]
            found = [dict(zip(head, row, strict=True)) for row in rows if len(row) == len(head)]
            for row in found:
                int(row[KEY])
                _ = [float(cell or "nan") for cell in row.values()]
    except RefusedError as error:
        raise ValueError(f"{path}: {error}; accepted: a table as training wrote it") from error
    return found


def read_columns(path: Path) -> dict[str, list[float]]:
    """The columns of a CSV file as numbers, NaN where empty; none if there is no file."""
    rows = read_rows(path) if path.exists() else []
    names = rows[0].keys() if rows else ()
    return {name: [float(row[name] or "nan") for row in rows] for name in names}


def _number(value: float) -> str:
    return cell_text(float(value), 7) if math.isfinite(value) else ""


class TensorBoard:
    """Scalars under a group's name. What an earlier process wrote beyond step `upto` is hidden.

    Each process writes its own file row by row: a full disk is noticed at once, which
    tensorboard's own writer does in a thread.
    """

    def __init__(self, directory: Path, upto: int = 0):
        from tensorboard.compat.proto import event_pb2, summary_pb2
        from tensorboard.summary.writer.record_writer import RecordWriter

        self._events: Any = event_pb2
        self._summaries: Any = summary_pb2
        directory.mkdir(parents=True, exist_ok=True)
        name = f"events.out.tfevents.{time.time_ns()}.{socket.gethostname()}.{os.getpid()}"
        self._file = (directory / name).open("xb", buffering=0)
        self._writer = RecordWriter(self._file)
        try:
            self._write(file_version="brain.Event:2")
            if upto:
                start = self._events.SessionLog(status=self._events.SessionLog.START)
                self._write(step=upto + 1, session_log=start)
        except BaseException:
            self._file.close()
            raise

    def add(self, group: str, timesteps: int, row: Mapping[str, float]) -> None:
        """Write the finite numbers of a row."""
        values = [
            self._summaries.Summary.Value(tag=f"{group}/{name}", simple_value=value)
            for name, value in row.items()
            if math.isfinite(value)
        ]
        self._write(step=timesteps, summary=self._summaries.Summary(value=values))

    def _write(self, **content: Any) -> None:
        self._writer.write(self._events.Event(wall_time=time.time(), **content).SerializeToString())

    def __enter__(self) -> TensorBoard:
        return self

    def __exit__(self, *error: object) -> None:
        self._file.close()
