"""`stickslip tasks`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.commands import OK, Outcome
from stickslip.parser import add_tables, completes

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

JSON = True
EXAMPLES = {
    "stickslip tasks": "all of them",
    "stickslip tasks BipedSprint-v1": "one in words: its numbers, and who earned what",
    "stickslip tasks --json": "every number, for a program to read",
}


def add_flags(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    """Add the tasks' names."""
    del arguments
    from stickslip.envs.tasks.ladder import TASKS

    names = parser.add_argument(
        "names", nargs="*", metavar="NAME", help="one or more of those below"
    )
    completes(names, TASKS)
    add_tables(parser, {"tasks": {name: task.title for name, task in TASKS.items()}})


def run(given: argparse.Namespace) -> Outcome:
    """Tell."""
    from stickslip.tasks_command import tasks_command

    return Outcome(OK, tasks_command(given.names))
