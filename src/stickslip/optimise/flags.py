"""Flags and settings of `stickslip optimise`, those of a drive for `simulate ugv`, too.

Words and numbers only: nothing heavy is imported.
"""

from __future__ import annotations

import ast
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, TypedDict, TypeGuard

from stickslip.dynamics.ugv.names import ROUGH_OPTIONS, TRACKS
from stickslip.flags import add_columns, add_overwrite
from stickslip.optim.gait import METHODS as GAIT_METHODS
from stickslip.optim.gait import OBJECTIVES
from stickslip.optim.posture.names import CRITERIA_IN_WORDS, METHODS
from stickslip.parser import add_tables, completes, truth

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

    from stickslip.parser import Parser


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


def add_drive_flags(parser: Parser) -> None:
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


class GaitFlags(TypedDict):
    """The flags as they are read."""

    objective: str
    mu: list[float] | None
    mean_rate: float | None
    torque_limit: str
    payload: float
    gravity: float
    min_normal: float
    zmp: bool
    copper_loss: float
    reserve: float
    steps: int | None
    start: float | None
    end: float | None
    cells: int
    feedback: float
    out: str | None
    overwrite: bool
    pictures: bool


def add_gait_flags(parser: Parser) -> None:
    """The problem's flags and those of the files; what names mean stands below."""
    _add_gait(parser)
    _add_walk(parser)
    add_files(parser, "runs/biped-OBJECTIVE", "gait")
    add_tables(parser, {"objectives": OBJECTIVES, "methods": GAIT_METHODS})


def _add_gait(parser: Parser) -> None:
    objective = parser.add_argument(
        "--objective",
        default="time",
        metavar="NAME",
        help="what is to be small, see below, or a sum: time=1,energy=0.2 (default: %(default)s)",
    )
    completes(objective, OBJECTIVES)
    parser.add_argument(
        "--mu",
        type=float,
        nargs="+",
        metavar="MU",
        help="static friction, one number or one a step (default: the foot never slips)",
    )
    parser.add_argument(
        "--mean-rate",
        type=float,
        metavar="RATE",
        help="at least this mean crank rate [rad/s] (default: any)",
    )
    parser.add_argument(
        "--torque-limit",
        default="4",
        metavar="NM",
        help="of the motor [N m], or none (default: %(default)s)",
    )
    parser.add_argument("--payload", type=float, default=0.0, metavar="KG", help="on the hip [kg]")
    parser.add_setting(
        "gravity", type=float, default=9.81, metavar="G", help="[m/s^2] (default: %(default)s)"
    )
    parser.add_setting(
        "min_normal",
        type=float,
        default=0.0,
        metavar="N",
        help="least normal force [N] (default: %(default)s)",
    )
    parser.add_setting(
        "zmp", type=truth, default=False, help="keep the zero-moment point inside the foot"
    )
    parser.add_setting(
        "copper_loss",
        type=float,
        default=0.5,
        metavar="W",
        help="of the objective energy [W/(N m)^2] (default: %(default)s)",
    )
    parser.add_setting(
        "reserve",
        type=float,
        default=0.0,
        metavar="SHARE",
        help="of the friction that the gait leaves unused; 0.02 lets the replay walk without a "
        "slip (default: %(default)s)",
    )


def _add_walk(parser: Parser) -> None:
    parser.add_argument(
        "--steps", type=int, metavar="N", help="a walk of so many (default: one periodic step)"
    )
    parser.add_setting(
        "start",
        type=float,
        metavar="RATE",
        help="crank rate at the beginning of a walk [rad/s] (default: 0, rest)",
    )
    parser.add_setting(
        "end",
        type=float,
        metavar="RATE",
        help="crank rate at its end [rad/s], 0 for a stop (default: any)",
    )
    parser.add_setting(
        "cells",
        type=int,
        default=200,
        metavar="N",
        help="of the grid in each step (default: 200)",
    )
    parser.add_setting(
        "feedback",
        type=float,
        default=2.0,
        metavar="GAIN",
        help="of the second replay [1/rad]; the first one has none (default: %(default)s)",
    )


MODULE = "stickslip.dynamics.ugv.track"


def track_options() -> dict[str, tuple[str, ...]]:
    """The options of each named track, `name=default`: the arguments of its constructor.

    They are read from the constructors' source, since importing it takes JAX; where an
    installation has no source, there are none.
    """
    loader: Any = getattr(find_spec(MODULE), "loader", None)
    source = loader.get_source(MODULE) if hasattr(loader, "get_source") else None
    found: dict[str, tuple[str, ...]] = dict.fromkeys(TRACKS, ())
    for one in ast.walk(ast.parse(source or "")):
        if isinstance(one, ast.ClassDef) and one.name == "Track":
            found |= {f.name: _words(f) for f in one.body if _builds_a_track(f)}
    return found


def _builds_a_track(statement: ast.stmt) -> TypeGuard[ast.FunctionDef]:
    return isinstance(statement, ast.FunctionDef) and statement.name in TRACKS


def _words(constructor: ast.FunctionDef) -> tuple[str, ...]:
    own = constructor.args
    optional = own.args[len(own.args) - len(own.defaults) :] + own.kwonlyargs
    pairs = zip(optional, [*own.defaults, *own.kw_defaults], strict=True)
    words = (f"{argument.arg}{_shown(default)}" for argument, default in pairs)
    return (*words, *(ROUGH_OPTIONS if own.kwarg else ()))


def _shown(default: ast.expr | None) -> str:
    if default is None:
        return ""
    return f"={default.value if isinstance(default, ast.Constant) else ast.unparse(default)}"


MACHINES = ("ugv", "biped")


def add_flags(parser: Parser, arguments: Sequence[str]) -> None:
    """Add the machine and its flags."""
    parser.add_argument(
        "machine",
        choices=MACHINES,
        help="what to optimise: the UGV's leg angles or the biped's gait; each has flags of its "
        "own, see --help after its name",
    )
    named = next((word for word in arguments if word in MACHINES), MACHINES[0])
    (add_gait_flags if named == "biped" else add_drive_flags)(parser)
