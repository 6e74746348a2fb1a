"""Progress bars: tqdm's where it is installed and asked for, else nothing."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import Any, TextIO


class Bar:
    """What all bars go through: `with Bar("dp", 60, "waypoint", shown) as bar: bar.advance()`.

    total: None where the number of steps is not known. at: how many of them are done already. to:
    standard error if None. large: counts in thousands and millions, width as the terminal's.
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
    ):
        self._bar: Any = None
        self._to = sys.stderr if to is None else to
        if shown:
            try:
                from tqdm import tqdm
            except ImportError:
                return
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

    def advance(self, count: int = 1, note: str = "") -> None:
        """Count on; note: shown behind the bar."""
        if self._bar is not None:
            if note:
                self._bar.set_postfix_str(note, refresh=False)
            self._bar.update(count)

    def say(self, line: str) -> None:
        """Print a line above the bar, shown or not."""
        if self._bar is None:
            print(line, file=self._to, flush=True)
        else:
            self._bar.write(line, file=self._to)
            self._to.flush()

    def __enter__(self) -> Bar:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Take the bar away."""
        if self._bar is not None:
            self._bar.close()
