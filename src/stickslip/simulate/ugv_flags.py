"""Flags and settings of `stickslip simulate ugv`; nothing heavy is imported."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypedDict

from stickslip.optim.posture.names import CRITERIA_IN_WORDS
from stickslip.optimise.drive_flags import add_limits, add_track, add_way, options_in_words
from stickslip.parser import add_tables

if TYPE_CHECKING:
    from stickslip.parser import Parser


class DriveFlags(TypedDict):
    """The flags as they are read."""

    posture: str | None
    angles: list[float] | None
    track: str
    track_options: list[str]
    columns: str | None
    friction: float
    spacing: float | None
    start: float | None
    end: float | None
    leg_rate: str
    max_torque: str
    out: str
    plot: str | None
    overwrite: bool


def add_ugv_flags(parser: Parser) -> None:
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
    add_track(ground)
    add_way(parser, "0.1", only=", with --angles")
    add_limits(parser)
    add_tables(parser, {"track options": options_in_words(), "criteria": CRITERIA_IN_WORDS})
