"""Completion of `stickslip`'s command lines in a shell, by argcomplete.

argcomplete runs this program for each Tab with the line so far in its environment, so commands have
the flags of the machine that stands on the line.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Mapping, Sequence


def complete(make_parser: Callable[[Sequence[str]], argparse.ArgumentParser]) -> None:
    """Print what may follow the line in the environment, as a shell's script reads it, and leave.

    An open quotation mark is no obstacle.
    """
    import argcomplete

    line = os.environ.get("COMP_LINE", "")[: int(os.environ.get("COMP_POINT", "0") or 0)]
    words = line.replace("'", " ").replace('"', " ").split()[1:]
    argcomplete.autocomplete(make_parser(words), always_complete_options="long")


def completion_command(flags: Mapping[str, Any]) -> None:
    """Print the script that a shell is to read."""
    import argcomplete

    print(argcomplete.shellcode(["stickslip"], shell=flags["shell"]), end="")
