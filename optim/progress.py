"""Progress on standard error, in one style.

On a terminal a bar of tqdm's, if installed; elsewhere a line now and then; none for short work.
"""

from __future__ import annotations

import io
import sys
import time
from contextlib import AbstractContextManager, suppress
from typing import Any, TextIO

EVERY = 10.0
"""Between two lines [s]."""


def say_stage(what: str) -> None:
    """Print a line about work without a count on standard error: "drawing ..."."""
    print(f"{what} ...", file=_stream(None), flush=True)


def _stream(to: TextIO | None) -> TextIO:
    """Stream of the bars: nowhere if standard error is closed, as without a console on Windows."""
    return to or sys.stderr or io.StringIO()


class Bar(AbstractContextManager["Bar"]):
    """Progress bar: `with Bar("dp", 60, "waypoint", shown) as bar: bar.advance()`.

    total: None where the number of steps is not known. at: how many of them are done already. to:
    standard error if None. large: counts in thousands and millions, width as the terminal's.
    shown=False is silent but for `say`. lines=False: none of its own where there is no bar.
    """

    def __init__(
        self,
        name: str,
        total: int | None,
        unit: str,
        shown: bool,
        *,
        at: int = 0,
        to: TextIO | None = None,
        large: bool = False,
        lines: bool = True,
    ):
        self._to = _stream(to)
        self._name, self._total, self._unit = name, total, unit
        self._at = self._first = at
        self._bar: Any = None
        if shown and self._to.isatty():
            with suppress(ImportError):
                from tqdm import tqdm

                self._bar = tqdm(
                    total=total,
                    initial=at,
                    file=self._to,
                    unit=unit if large else f" {unit}",
                    unit_scale=large,
                    dynamic_ncols=large,
                    desc=name,
                    leave=False,
                )
        self._lines = shown and lines and self._bar is None
        self._begun = self._last = time.monotonic()

    def advance(self, count: int = 1, note: str = "") -> None:
        """Count on; note: shown behind the bar."""
        self._at += count
        if self._bar is not None:
            if note:
                self._bar.set_postfix_str(note, refresh=False)
            self._bar.update(count)
        elif self._lines and time.monotonic() - self._last >= EVERY:
            self._last = time.monotonic()
            self.say(self._line(self._last - self._begun))

    def note(self, text: str) -> None:
        """Show text behind the bar; nothing where there is no bar."""
        if self._bar is not None:
            self._bar.set_postfix_str(text)

    def say(self, line: str) -> None:
        """Print a line above the bar, shown or not."""
        if self._bar is not None:
            self._bar.write(line, file=self._to)
        else:
            print(line, file=self._to)
        self._to.flush()

    def _line(self, seconds: float) -> str:
        rate = (self._at - self._first) / seconds
        of = "" if self._total is None else f" of {self._total:,}"
        speed = f"{rate:,.0f}" if rate >= 10 else f"{rate:.2g}"
        line = f"{self._name}: {self._at:,}{of} {self._unit}s, {speed} a second"
        if self._total is None or not rate:
            return line
        left = max(self._total - self._at, 0) / rate
        return f"{line}, about {int(left) // 60}:{int(left) % 60:02d} to go"

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()
