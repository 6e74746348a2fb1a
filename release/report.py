"""A line for every check as it ends, and the failed ones once more at the end."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

LAST = 40
"""Lines of a failed command's output that are shown."""


class FailedError(Exception):
    """A check failed; the text says how."""


class Report:
    """What was checked. A check is a `with`: whatever FailedError is raised in it is kept."""

    def __init__(self) -> None:
        self.done = 0
        self.failed: dict[str, str] = {}

    @contextmanager
    def check(self, name: str) -> Iterator[None]:
        """One check by its name; those that follow go on."""
        print(f"{name} ...", end=" ", flush=True)
        begun = time.monotonic()
        self.done += 1
        try:
            yield
        except FailedError as error:
            self.failed[name] = "\n".join(str(error).splitlines()[-LAST:])
        said = "FAILED" if name in self.failed else "well"
        print(f"{said}, {time.monotonic() - begun:.0f} s", flush=True)

    def end(self) -> int:
        """Show what failed and count; the exit status."""
        for name, how in self.failed.items():
            print(f"\n{name}: FAILED\n{how}")
        print(f"\n{self.done - len(self.failed)} checks passed, {len(self.failed)} failed")
        return 1 if self.failed else 0
