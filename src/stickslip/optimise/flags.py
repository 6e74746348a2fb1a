"""The flags of `stickslip optimise`: words and numbers only, nothing heavy is imported."""

from __future__ import annotations

import argparse

from stickslip.optim.posture.names import CRITERIA_IN_WORDS, METHODS
from stickslip.optimise.drive_flags import add_limits, add_track, add_way, options_in_words
from stickslip.optimise.file_flags import add_files
from stickslip.parser import add_tables, completes


def add_flags(parser: argparse.ArgumentParser) -> None:
    """The problem's flags, the method's and those of the files; what names mean stands below."""
    _add_problem(parser.add_argument_group("problem"))
    _add_method(parser.add_argument_group("method"))
    add_files(parser, "runs/ugv-TRACK-CRITERION-METHOD", "drive")
    tracks = {"track options": options_in_words()}
    add_tables(parser, tracks | {"criteria": CRITERIA_IN_WORDS, "methods": METHODS})


def _add_problem(group: argparse._ArgumentGroup) -> None:
    add_track(group)
    add_limits(group)
    criterion = group.add_argument(
        "--criterion",
        default="wheel_energy",
        metavar="NAME",
        help="what is to be small, see below (default: %(default)s)",
    )
    completes(criterion, CRITERIA_IN_WORDS)
    group.add_argument(
        "--overlap",
        action="store_true",
        help="let the wheels overlap, as the chapter does, to compare with it; no vehicle can",
    )
    add_way(group, None, "0.1, or more on a long track: 5000 waypoints at most")
    for name, which in (("start", "first"), ("end", "last")):
        group.add_argument(
            f"--{name}-angles",
            type=float,
            nargs=2,
            metavar="RAD",
            help=f"rear and front leg at the {which} waypoint (default: any)",
        )


def _add_method(group: argparse._ArgumentGroup) -> None:
    method = group.add_argument(
        "--method", default="dp", metavar="NAME", help="see below (default: %(default)s)"
    )
    completes(method, METHODS)
    group.add_argument(
        "--angles",
        type=int,
        metavar="N",
        help="of each leg on the grid, over its range (default: a grid that uses the leg rate)",
    )
    group.add_argument(
        "--polish",
        action=argparse.BooleanOptionalAction,
        help="let scp follow the grid's path (default: up to 2000 waypoints)",
    )
    group.add_argument("--seed", type=int, metavar="N", help="of the method cma")
