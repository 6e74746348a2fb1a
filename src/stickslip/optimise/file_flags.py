"""Flags of the files that `stickslip optimise` writes, of whichever machine."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.commands.shared import add_overwrite

if TYPE_CHECKING:
    import argparse


def add_files(parser: argparse.ArgumentParser, default: str, what: str) -> None:
    """Add flags of output files; what: a plot shows."""
    parser.add_argument("--out", metavar="DIR", help=f"where files go (default: {default})")
    add_overwrite(parser, "the result in --out")
    parser.add_argument(
        "--no-pictures",
        dest="pictures",
        action="store_false",
        help=f"no plot of the {what}, no report",
    )
