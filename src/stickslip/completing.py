"""What a shell is told when it asks what may follow on a command line of `stickslip`.

argcomplete runs this program for each Tab with the line so far in its environment, so commands have
the flags of the machine that stands on the line, which no script written beforehand could know.
"""

from __future__ import annotations

import os
import shlex
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Sequence

SHELLS = ("bash", "zsh", "fish")
PROGRAM = "stickslip"


def complete(make_parser: Callable[[Sequence[str]], argparse.ArgumentParser]) -> None:
    """Write what may follow where argcomplete's script reads it, and leave."""
    import argcomplete

    line = os.environ.get("COMP_LINE", "")[: int(os.environ.get("COMP_POINT", "0") or 0)]
    argcomplete.autocomplete(make_parser(_words(line)), always_complete_options="long")


def script(shell: str) -> str:
    """What a shell is to read once so that it asks."""
    import argcomplete

    return argcomplete.shellcode([PROGRAM], shell=shell)


def _words(line: str) -> list[str]:
    try:
        return shlex.split(line)[1:]
    except ValueError:  # a quotation mark that is still open
        return line.split()[1:]
