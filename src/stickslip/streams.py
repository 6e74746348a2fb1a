"""Standard output and error as they may be: closed, or of a terminal that has few letters."""

from __future__ import annotations

import codecs
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO

PLAIN = "stickslip-plain"
"""Name of the error handler."""
INSTEAD = {"─": "-", "±": "+-", "×": "x", "–": "-", "…": "...", "²": "2", "°": " deg"}
"""Replacements for letters that the encoding lacks; a question mark for others."""


def prepare_streams() -> None:
    """Make both fit to print on, whatever the surroundings gave.

    A closed one (None in Python, which then prints errors on the other) leads nowhere; one whose
    encoding lacks a letter (ASCII, Windows' code pages) gets a plainer one, where Python would end
    a command whose work is done.
    """
    codecs.register_error(PLAIN, _plain)
    for name in ("stdout", "stderr"):
        stream: IO[str] | None = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif getattr(stream, "errors", None) == "strict" and hasattr(stream, "reconfigure"):
            stream.reconfigure(errors=PLAIN)  # pyright: ignore[reportAttributeAccessIssue]


@contextmanager
def whole_output() -> Iterator[None]:
    """Standard output is written whole at the end, while a failure of that can still be told."""
    try:
        yield
    finally:
        sys.stdout.flush()


def _plain(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    missing = error.object[error.start : error.end]
    return "".join(INSTEAD.get(letter, "?") for letter in missing), error.end
