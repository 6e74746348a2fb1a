"""Flags and settings of `stickslip optimise ugv`; nothing heavy is imported."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.optim.posture.names import CRITERIA_IN_WORDS, METHODS
from stickslip.optimise.drive_flags import add_limits, add_track, add_way, options_in_words
from stickslip.optimise.file_flags import add_files
from stickslip.parser import add_tables, completes, truth

if TYPE_CHECKING:
    from stickslip.parser import Parser


def add_flags(parser: Parser) -> None:
    """The problem's flags, the method's and those of the files; what names mean stands below."""
    _add_problem(parser)
    _add_method(parser)
    add_files(parser, "runs/ugv-TRACK-CRITERION-METHOD", "drive")
    tracks = {"track options": options_in_words()}
    add_tables(parser, tracks | {"criteria": CRITERIA_IN_WORDS, "methods": METHODS})


def _add_problem(parser: Parser) -> None:
    add_track(parser)
    add_limits(parser)
    criterion = parser.add_argument(
        "--criterion",
        default="wheel_energy",
        metavar="NAME",
        help="what is to be small, see below (default: %(default)s)",
    )
    completes(criterion, CRITERIA_IN_WORDS)
    parser.add_setting(
        "overlap",
        type=truth,
        default=False,
        help="let the wheels overlap, as the chapter does, to compare with it; no vehicle can",
    )
    add_way(parser, "0.1, or more on a long track: 5000 waypoints at most")
    for name, which in (("start", "first"), ("end", "last")):
        parser.add_setting(
            f"{name}_angles",
            type=float,
            nargs=2,
            metavar="RAD",
            help=f"rear and front leg at the {which} waypoint (default: any)",
        )


def _add_method(parser: Parser) -> None:
    method = parser.add_argument(
        "--method", default="dp", metavar="NAME", help="see below (default: %(default)s)"
    )
    completes(method, METHODS)
    parser.add_setting(
        "angles",
        type=int,
        metavar="N",
        help="of each leg on the grid, over its range (default: a grid that uses the leg rate)",
    )
    parser.add_setting(
        "polish",
        type=truth,
        help="let scp follow the grid's path (default: up to 2000 waypoints)",
    )
    parser.add_argument("--seed", type=int, metavar="N", help="of the method cma")
