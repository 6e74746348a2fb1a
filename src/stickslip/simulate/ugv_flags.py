"""The flags of `stickslip simulate ugv`: words and numbers only, nothing heavy is imported."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypedDict

from stickslip.dynamics.ugv.names import TRACKS
from stickslip.optim.posture.names import CRITERIA_IN_WORDS
from stickslip.optimise.track_options import track_options
from stickslip.parser import add_tables, completes

if TYPE_CHECKING:
    import argparse


class DriveFlags(TypedDict):
    """The flags as they are read."""

    posture: str | None
    angles: list[float] | None
    track: str
    track_options: list[str]
    friction: float
    spacing: float | None
    start: float | None
    end: float | None
    leg_rate: str
    max_torque: str
    out: str
    plot: str | None
    overwrite: bool


def add_ugv_flags(parser: argparse.ArgumentParser) -> None:
    """The posture, the ground and the limits."""
    posture = parser.add_argument_group("posture (one of them)")
    posture.add_argument(
        "--posture",
        metavar="FILE",
        help="stations.csv of `stickslip optimise ugv`, or its directory: places and leg angles",
    )
    posture.add_argument(
        "--angles",
        type=float,
        nargs=2,
        metavar="DEG",
        help="rear and front leg, held [degrees]: 90 is straight down, more is outwards",
    )
    ground = parser.add_argument_group("ground")
    track = ground.add_argument(
        "--track",
        default="bump",
        metavar="NAME_OR_FILE",
        help=f"{', '.join(TRACKS)}, or a file of x and y or GPX (default: %(default)s)",
    )
    completes(track, TRACKS)
    ground.add_argument(
        "--track-option",
        dest="track_options",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="of the track, as often as needed: height=0.2; see below",
    )
    ground.add_argument(
        "--friction",
        type=float,
        default=0.8,
        metavar="MU",
        help="between wheels and ground [-] (default: %(default)s)",
    )
    ground.add_argument(
        "--spacing",
        type=float,
        metavar="M",
        help="of waypoints, with --angles [m] (default: 0.1)",
    )
    for name, which in (("start", "first"), ("end", "last")):
        ground.add_argument(
            f"--{name}",
            type=float,
            metavar="M",
            help=f"{which} place of the front wheel, with --angles",
        )
    limits = parser.add_argument_group("limits")
    limits.add_argument(
        "--leg-rate",
        default="1.0",
        metavar="RATE",
        help="what a leg may turn for each metre [rad/m], or none for no limit "
        "(default: %(default)s)",
    )
    limits.add_argument(
        "--max-torque",
        default="none",
        metavar="NM",
        help="of each wheel's motor, either way [N m], or none for no limit (default: %(default)s)",
    )
    options = {name: ", ".join(words) for name, words in track_options().items()}
    options["a file"] = "interpolation"
    add_tables(parser, {"track options": options, "criteria": CRITERIA_IN_WORDS})
