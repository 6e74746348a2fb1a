"""Flags and settings of a UGV's drive that several commands have."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.commands.shared import add_columns
from stickslip.dynamics.ugv.names import TRACKS
from stickslip.optimise.track_options import track_options
from stickslip.parser import completes

if TYPE_CHECKING:
    import argparse

    from stickslip.parser import Parser


def add_track(group: argparse._ActionsContainer) -> None:
    """Add flags of ground and friction."""
    track = group.add_argument(
        "--track",
        default="bump",
        metavar="NAME_OR_FILE",
        help=f"{', '.join(TRACKS)}, or a file of x and y or GPX (default: %(default)s)",
    )
    completes(track, TRACKS)
    group.add_argument(
        "--track-option",
        dest="track_options",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="of the track, as often as needed: height=0.2; see below",
    )
    add_columns(group, "a track's file", "x=x_m,z=elev_m")
    group.add_argument(
        "--friction",
        type=float,
        default=0.8,
        metavar="MU",
        help="between wheels and ground [-] (default: %(default)s)",
    )


def add_way(parser: Parser, default: str, only: str = "") -> None:
    """From where to where, and how far waypoints are apart; only: when these settings count."""
    parser.add_setting(
        "spacing", type=float, metavar="M", help=f"of waypoints{only} [m] (default: {default})"
    )
    for name, which in (("start", "first"), ("end", "last")):
        parser.add_setting(
            name, type=float, metavar="M", help=f"{which} place of the front wheel{only}"
        )


def add_limits(parser: Parser) -> None:
    """Add flags of the limits of legs and motors."""
    parser.add_argument(
        "--max-torque",
        default="none",
        metavar="NM",
        help="of each wheel's motor, either way [N m], or none for no limit (default: %(default)s)",
    )
    parser.add_setting(
        "leg_rate",
        default="1.0",
        metavar="RATE",
        help="what a leg may turn for each metre [rad/m], or none for no limit "
        "(default: %(default)s)",
    )


def options_in_words() -> dict[str, str]:
    """The options of each track, for the end of a help."""
    options = {name: ", ".join(words) for name, words in track_options().items()}
    return {**options, "a file": "interpolation"}
