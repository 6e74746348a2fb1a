"""`stickslip export`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.commands import Outcome
from stickslip.commands.shared import add_overwrite, add_who, shipped
from stickslip.parser import add_tables

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

JSON = False
EXAMPLES = {
    "stickslip export biped-ice --out ice.onnx": "for any runtime of ONNX",
    "stickslip demo": "trains a walker, into runs/demo",
    "stickslip export runs/demo --out walker.npz": "of a run, here that one, for NumPy alone",
}


def add_flags(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    """Add the policy and the file."""
    del arguments
    add_who(parser, "one of those below, a file or a run")
    parser.add_argument(
        "--out", metavar="FILE", required=True, help=".onnx, or .npz for NumPy alone"
    )
    add_overwrite(parser, "the file")
    add_tables(parser, shipped())


def run(given: argparse.Namespace) -> Outcome:
    """Write it."""
    from stickslip.agents.shipped.command import export_command

    export_command(given.who, given.out, given.overwrite)
    return Outcome()
