"""`stickslip policies`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.commands import OK, Outcome
from stickslip.commands.shared import shipped
from stickslip.parser import add_tables, completes

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

JSON = True
EXAMPLES = {
    "stickslip policies": "all of them",
    "stickslip policies biped-ice": "one in words: how it was trained, what it earns",
    "stickslip policies --json": "every number, for a program to read",
}


def add_flags(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    """Add the policies' names."""
    del arguments
    tables = shipped()
    names = parser.add_argument(
        "names", nargs="*", metavar="NAME", help="one or more of those below"
    )
    completes(names, tables["policies"])
    add_tables(parser, tables)


def run(given: argparse.Namespace) -> Outcome:
    """Tell."""
    from stickslip.agents.shipped.command import policies_command

    return Outcome(OK, policies_command(given.names))
