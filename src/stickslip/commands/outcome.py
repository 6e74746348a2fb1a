"""Outcome of a command: an exit status and its results."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from stickslip.records.content import Content

OK, NOTHING_FOUND, WRONG_INPUT, READER_LEFT = 0, 1, 2, 141
"""Exit statuses. NOTHING_FOUND: no drive, no gait, or a simulated machine that did not get to the
end of what was asked. READER_LEFT: nobody reads the output any more, as shells count it."""


class Outcome(NamedTuple):
    """found: for --json, None where there is nothing to tell."""

    status: int = OK
    found: Content | None = None
