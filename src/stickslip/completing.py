"""Completion of `stickslip`'s command lines in a shell.

argcomplete runs this program for each Tab with the line so far in its environment, so commands have
the flags of the machine that stands on the line, which no script written beforehand could know.
"""

from __future__ import annotations

import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Mapping, Sequence

    from argcomplete.completers import BaseCompleter

SHELLS = ("bash", "zsh", "fish")
PROGRAM = "stickslip"
BEFORE, BEHIND = (
    """\
(( $+functions[compdef] )) || { autoload -U compinit; compinit; }
""",
    """\
_stickslip() {
    _python_argcomplete "$@" || _files
}
compdef _stickslip stickslip
""",
)
"""Additions for zsh: its completion switched on, files where the program offers nothing."""


def complete(make_parser: Callable[[Sequence[str]], argparse.ArgumentParser]) -> None:
    """Write what may follow where argcomplete's script reads it, and leave."""
    import argcomplete

    line = os.environ.get("COMP_LINE", "")[: int(os.environ.get("COMP_POINT", "0") or 0)]
    others = cast("BaseCompleter", files)  # which it calls, and asks for no class
    argcomplete.autocomplete(
        make_parser(_words(line)), always_complete_options="long", default_completer=others
    )


def script(shell: str) -> str:
    """Script that enables completion in a shell."""
    import argcomplete

    code = argcomplete.shellcode([PROGRAM], shell=shell)
    if shell != "zsh":
        return code
    first, rest = code.split("\n", 1)
    return f"{first}\n{BEFORE}{rest}{BEHIND}"


def files(prefix: str, **_: object) -> list[str]:
    """Files and folders that begin as what is typed, for fish; bash and zsh, told of nothing, look
    for themselves."""
    if os.environ.get("_ARGCOMPLETE_SHELL") != "fish":
        return []
    folder, slash, name = prefix.rpartition("/")
    try:
        there = sorted(Path(f"{folder}{slash}" or ".").expanduser().iterdir())
    except (OSError, RuntimeError):  # no such folder, not ours to read, or nobody of that name
        return []
    return [
        f"{folder}{slash}{one.name}{'/' if one.is_dir() else ''}"
        for one in there
        if one.name.startswith(name) and (name or not one.name.startswith("."))
    ]


def _words(line: str) -> list[str]:
    try:
        return shlex.split(line)[1:]
    except ValueError:  # a quotation mark that is still open
        return line.split()[1:]


def completion_command(flags: Mapping[str, Any]) -> None:
    """Print what the shell is to read."""
    print(script(flags["shell"]), end="")
