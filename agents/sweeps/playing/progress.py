"""How far pieces of work are: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

from threading import Lock
from typing import TextIO

from stickslip.optim.progress import Bar


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
        self._lock = Lock()
        self._bar = Bar(name, total, unit, shown, at=at, to=to, large=True)

    def advance(self, count: int) -> None:
        """So many more were done."""
        with self._lock:
            self._bar.advance(count)

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.close()
