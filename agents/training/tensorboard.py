"""TensorBoard's files, without repeating what a resumption repeats."""

from __future__ import annotations

import math
import os
import socket
import time
from typing import TYPE_CHECKING, Any

from tensorboard.compat.proto import event_pb2, summary_pb2
from tensorboard.summary.writer.record_writer import RecordWriter

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

EVENTS: Any = event_pb2
SUMMARIES: Any = summary_pb2
"""Their classes are made when they are imported."""
FORMAT = "brain.Event:2"


class TensorBoard:
    """Scalars under a group's name. What an earlier process wrote beyond step `upto` is hidden.

    Each process writes its own file, as TensorBoard expects, row by row: nothing is pending, and a
    disk that is full says so at once (tensorboard's own writer does so in a thread).
    """

    def __init__(self, directory: Path, upto: int = 0):
        directory.mkdir(parents=True, exist_ok=True)
        name = f"events.out.tfevents.{time.time_ns()}.{socket.gethostname()}.{os.getpid()}"
        self._file = (directory / name).open("xb", buffering=0)
        self._writer = RecordWriter(self._file)
        try:
            self._write(file_version=FORMAT)
            if upto:
                start = EVENTS.SessionLog(status=EVENTS.SessionLog.START)
                self._write(step=upto + 1, session_log=start)
        except BaseException:
            self._file.close()
            raise

    def add(self, group: str, timesteps: int, row: Mapping[str, float]) -> None:
        """Write the finite numbers of a row."""
        values = [
            SUMMARIES.Summary.Value(tag=f"{group}/{name}", simple_value=value)
            for name, value in row.items()
            if math.isfinite(value)
        ]
        self._write(step=timesteps, summary=SUMMARIES.Summary(value=values))

    def _write(self, **content: Any) -> None:
        self._writer.write(EVENTS.Event(wall_time=time.time(), **content).SerializeToString())

    def __enter__(self) -> TensorBoard:
        return self

    def __exit__(self, *error: object) -> None:
        self._file.close()
