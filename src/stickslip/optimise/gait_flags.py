"""Flags and settings of `stickslip optimise biped`; nothing heavy is imported."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypedDict

from stickslip.optim.gait.names import METHODS, OBJECTIVES
from stickslip.optimise.file_flags import add_files
from stickslip.parser import add_tables, completes, truth

if TYPE_CHECKING:
    from stickslip.parser import Parser


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
    _add_problem(parser)
    _add_walk(parser)
    add_files(parser, "runs/biped-OBJECTIVE", "gait")
    add_tables(parser, {"objectives": OBJECTIVES, "methods": METHODS})


def _add_problem(parser: Parser) -> None:
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
