"""How far pieces of work are: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from threading import Lock
from typing import TextIO

from stickslip.optim.progress import Bar

EVERY = 10.0
"""Between two lines [s]."""


class Progress:
    """Told of episodes from any thread, or of another `unit` of what `name` does. shown: False is
    silent."""

    def __init__(
        self,
        total: int,
        at: int,
        shown: bool,
        to: TextIO | None = None,
        *,
        name: str = "sweep",
        unit: str = "episode",
    ):
        self._to = sys.stderr if to is None else to
        self._lines = shown and not self._to.isatty()
        self._total, self._at, self._first, self._unit = total, at, at, unit
        self._begun = self._told = time.monotonic()
        self._lock = Lock()
        bar = shown and not self._lines
        self._bar = Bar(name, total, unit, bar, at=at, to=self._to, large=True)

    def advance(self, count: int) -> None:
        """So many more were done."""
        with self._lock:
            self._at += count
            self._bar.advance(count)
            now = time.monotonic()
            if self._lines and now - self._told >= EVERY:
                self._told = now
                self._bar.say(self._line(now - self._begun))

    def _line(self, seconds: float) -> str:
        rate = (self._at - self._first) / seconds
        left = (self._total - self._at) / rate
        return (
            f"{self._at:,} of {self._total:,} {self._unit}s, {rate:,.{0 if rate >= 10 else 2}f} a "
            "second, about "
            f"{int(left) // 60}:{int(left) % 60:02d} to go"
        )

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.close()
