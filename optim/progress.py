"""Progress bars for methods: tqdm's where it is installed and asked for, else nothing."""

from __future__ import annotations

from types import TracebackType
from typing import Any


class Bar:
    """A bar of one method: `with Bar("dp", 60, "waypoint", shown) as bar: bar.advance()`.

    total: None where the number of steps is not known.
    """

    def __init__(self, method: str, total: int | None, unit: str, shown: bool):
        self._bar: Any = None
        if shown:
            try:
                from tqdm import tqdm
            except ImportError:
                return
            self._bar = tqdm(total=total, desc=method, unit=f" {unit}", leave=False)

    def advance(self, count: int = 1, note: str = "") -> None:
        """Count on; note: shown behind the bar."""
        if self._bar is not None:
            if note:
                self._bar.set_postfix_str(note, refresh=False)
            self._bar.update(count)

    def __enter__(self) -> Bar:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.close()
