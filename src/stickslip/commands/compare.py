"""`stickslip compare`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.commands import OK, Outcome

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

JSON = True
EXAMPLES = {
    "stickslip sweep biped --policy crank-speed-pi --axis mu=0.05:0.3:6 --out runs/moving": (
        "walks that begin in motion"
    ),
    "stickslip sweep biped --policy crank-speed-pi --axis mu=0.05:0.3:6 --start rest "
    "--out runs/rest": "walks from rest",
    "stickslip compare runs/moving runs/rest --out points.csv": "every point of the two",
}


def add_flags(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    """Two sweeps."""
    del arguments
    from stickslip.agents.sweeps.flags import add_compare_flags

    add_compare_flags(parser)


def run(given: argparse.Namespace) -> Outcome:
    """Compare."""
    from stickslip.agents.sweeps.compare import compare_command

    return Outcome(OK, compare_command(vars(given)))
