"""A line for every check as it goes on; at the end how the failed ones failed, and a table."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

LAST = 40
"""Lines of a failed command's output that are shown."""
INTERRUPTED = 130
"""Exit status after Ctrl-C, as a shell has it."""


class FailedError(Exception):
    """A check failed; the text says how."""


Say = Callable[[str], None]
"""Told by a check what it has done so far, which its line shows."""


@dataclass(frozen=True)
class Check:
    """One check: a cell of the table, by its row and column."""

    what: str
    where: str
    do: Callable[[Say], None]
    """Raises FailedError."""


class Report:
    """Does checks one after the other, whatever becomes of those before."""

    def __init__(self) -> None:
        self.results: dict[tuple[str, str], str] = {}
        self.failed: dict[str, str] = {}
        self.interrupted = False

    def run(self, checks: Sequence[Check]) -> int:
        """Do all of them and show the table; the exit status."""
        for number, check in enumerate(checks, start=1):
            print(f"[{number}/{len(checks)}] {check.what}, {check.where}:", end=" ", flush=True)
            try:
                self._do(check)
            except KeyboardInterrupt:
                print("interrupted")
                self.interrupted = True
                break
        return self.end(len(checks))

    def _do(self, check: Check) -> None:
        begun, result = time.monotonic(), ""
        try:
            check.do(lambda text: print(text, end=" ", flush=True))
        except FailedError as error:
            self.failed[f"{check.what}, {check.where}"] = "\n".join(str(error).splitlines()[-LAST:])
            result = "FAILED "
        took = f"{time.monotonic() - begun:.0f} s"
        print(f"{result or 'well, '}{took}", flush=True)
        self.results[check.what, check.where] = result + took

    def end(self, asked: int) -> int:
        """Show how the failed ones failed, the table and the count; the exit status."""
        for name, how in self.failed.items():
            print(f"\n{name}: FAILED\n{how}")
        print(f"\n{table(self.results)}\n")
        left = asked - len(self.results)
        print(
            f"{len(self.results) - len(self.failed)} checks passed, {len(self.failed)} failed"
            + (f", {left} not done" if left else "")
        )
        if self.interrupted:
            return INTERRUPTED
        return 1 if self.failed or left else 0


def table(cells: dict[tuple[str, str], str]) -> str:
    """Rows and columns in the order in which they came; a dash where there is no cell."""
    rows = list(dict.fromkeys(row for row, _ in cells))
    columns = list(dict.fromkeys(column for _, column in cells))
    lines = [["", *columns]]
    lines += [[row, *(cells.get((row, column), "-") for column in columns)] for row in rows]
    return in_columns(lines)


def in_columns(lines: Iterable[Sequence[str]]) -> str:
    """Cells beside each other: the first flush left, the others right."""
    lines = list(lines)
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        "  ".join(
            text.rjust(width) if place else text.ljust(width)
            for place, (text, width) in enumerate(zip(line, widths, strict=True))
        )
        for line in lines
    )
