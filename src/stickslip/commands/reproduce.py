"""`stickslip reproduce`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.commands import OK, Outcome
from stickslip.commands.shared import add_overwrite
from stickslip.parser import add_tables, completes

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

JSON = True
EXAMPLES = {
    "stickslip reproduce fig13 fig17": "two figures",
    "stickslip reproduce all --out figures --overwrite": "all of them, some minutes",
}


def add_flags(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    """Add the figures' names."""
    del arguments
    from stickslip.paper.figure import EVERYTHING, FIGURES

    figures = parser.add_argument(
        "figures",
        nargs="+",
        metavar="FIGURE",
        help=f"one or more of those below, or {EVERYTHING}",
    )
    completes(figures, (*FIGURES, EVERYTHING))
    parser.add_argument(
        "--out", metavar="DIR", default="figures", help="where files go (default: %(default)s)"
    )
    add_overwrite(parser, "files in --out")
    parser.add_argument(
        "--samples",
        type=int,
        default=240,
        metavar="N",
        help="points a step; of fig24 along the bump (default: %(default)s)",
    )
    add_tables(parser, {"figures": {name: one.title for name, one in FIGURES.items()}})


def run(given: argparse.Namespace) -> Outcome:
    """Compute, draw and compare."""
    from stickslip.paper.command import reproduce_command

    return Outcome(OK, reproduce_command(vars(given)))
