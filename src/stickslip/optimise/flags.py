"""Flags and settings of `stickslip optimise`; nothing heavy is imported."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from stickslip.dynamics.names import TRACKS
from stickslip.optim.gait import METHODS as GAIT_METHODS
from stickslip.optim.gait import OBJECTIVES
from stickslip.optim.posture import CRITERIA_IN_WORDS, METHODS
from stickslip.parser import add_options, add_tables, changes_option, limit, option, set_option

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.parser import Parser

MACHINES = {"ugv": "leg angles along a track", "biped": "the best gait"}
TRACK_OPTIONS = {
    "flat": ("start=0.0", "end=8.0"),
    "incline": ("slope=0.3", "start=0.0", "end=8.0"),
    "bump": ("height=0.1", "centre=4.0", "width=1.0", "start=0.0", "end=8.0"),
    "sinusoid": ("amplitude=0.05", "wavelength=2.0", "start=0.0", "end=8.0"),
    "ramp": ("slope=0.3", "position=2.0", "length=4.0", "joint=1.0", "start=0.0", "end=8.0"),
    "step": ("height=0.1", "position=4.0", "length=0.5", "start=0.0", "end=8.0"),
    "ditch": ("depth=0.1", "position=4.0", "width=1.0", "side=0.5", "start=0.0", "end=8.0"),
    "rough": ("key=0", "iso_class=C", "start=0.0", "end=20.0", "margin=2.0"),
}
"""Arguments of each named track's constructor, with their defaults."""
TRACK_TABLE = {
    "track options": {name: ", ".join(words) for name, words in TRACK_OPTIONS.items()}
    | {"a file": "interpolation"}
}


def add_flags(parser: Parser, arguments: Sequence[str]) -> None:
    """Add the machine and its flags."""
    if not parser.add_machine(MACHINES, arguments):
        return
    if "biped" in arguments:
        add_options(parser, GaitOptions)
        add_tables(parser, {"objectives": OBJECTIVES, "methods": GAIT_METHODS})
    else:
        add_options(parser, PostureOptions)
        add_tables(parser, TRACK_TABLE | {"criteria": CRITERIA_IN_WORDS, "methods": METHODS})


@dataclass(frozen=True)
class RobotOptions:
    """A robot of one's own."""

    robot: str | None = option(
        None,
        "a robot's file in TOML; --set robot.NAME=VALUE changes a number",
        metavar="FILE",
    )
    changes: dict[str, str] = changes_option("robot", "bars", "motor")


@dataclass(frozen=True)
class VehicleOptions:
    """A vehicle of one's own."""

    vehicle: str | None = option(
        None,
        "a vehicle's file in TOML; --set vehicle.NAME=VALUE changes a number",
        metavar="FILE",
    )
    changes: dict[str, str] = changes_option("vehicle", "motor")


@dataclass(frozen=True)
class TrackOptions(VehicleOptions):
    """Ground, waypoints and limits of a drive."""

    track: str = option(
        "bump",
        f"{', '.join(TRACKS)}, or a file of x and y or GPX",
        metavar="NAME_OR_FILE",
        names=TRACKS,
    )
    track_options: list[str] = option(
        [],
        "of the track, as often as needed: height=0.2; see below",
        flag="--track-option",
        action="append",
        metavar="NAME=VALUE",
    )
    columns: str | None = option(
        None,
        "the columns of a track's file whose heads are other names: x=x_m,z=elev_m",
        metavar="NAME=HEAD,...",
    )
    friction: float = option(0.8, "between wheels and ground [-]", metavar="MU")
    max_torque: float | None = option(
        None,
        "of each wheel's motor, either way [N m], or none (default: of the vehicle's file)",
        type=limit,
        metavar="NM",
    )
    leg_rate: float | None = set_option(
        1.0,
        "what a leg may turn for each metre [rad/m], or none for no limit",
        type=limit,
        metavar="RATE",
    )
    spacing: float | None = set_option(
        None,
        "of waypoints [m] (default: 0.1, or more on a long track: 5000 waypoints at most)",
        metavar="M",
    )
    start: float | None = set_option(None, "first place of the front wheel", metavar="M")
    end: float | None = set_option(None, "last place of the front wheel", metavar="M")


@dataclass(frozen=True)
class Output:
    """Files of an optimisation."""

    overwrite: bool = option(False, "replace the result in --out")
    pictures: bool = option(True, "no plot")


@dataclass(frozen=True)
class PostureOptions(TrackOptions, Output):
    """A posture problem and the method that solves it."""

    criterion: str = option(
        "wheel_energy", "what is to be small, see below", metavar="NAME", names=CRITERIA_IN_WORDS
    )
    method: str = option("dp", "see below", metavar="NAME", names=METHODS)
    seed: int | None = option(None, "of the method cma", metavar="N")
    out: str | None = option(
        None, "where files go (default: runs/ugv-TRACK-CRITERION-METHOD)", metavar="DIR"
    )
    overlap: bool = set_option(
        False, "let the wheels overlap, as the chapter does, to compare with it; no vehicle can"
    )
    start_angles: tuple[float, float] | None = set_option(
        None, "rear and front leg at the first waypoint (default: any)", metavar="RAD"
    )
    end_angles: tuple[float, float] | None = set_option(
        None, "rear and front leg at the last waypoint (default: any)", metavar="RAD"
    )
    angles: int | None = set_option(
        None,
        "of each leg on the grid, over its range (default: a grid that uses the leg rate)",
        metavar="N",
    )
    polish: bool | None = set_option(
        None, "let scp follow the grid's path (default: up to 2000 waypoints)"
    )


@dataclass(frozen=True)
class GaitOptions(RobotOptions, Output):
    """A gait problem."""

    objective: str = option(
        "time",
        "what is to be small, see below, or a sum: time=1,energy=0.2",
        metavar="NAME",
        names=OBJECTIVES,
    )
    mu: list[float] | None = option(
        None,
        "static friction, one number or one a step (default: the foot never slips)",
        metavar="MU",
    )
    mean_rate: float | None = option(
        None, "at least this mean crank rate [rad/s] (default: any)", metavar="RATE"
    )
    torque_limit: float | None = option(
        None,
        "of the motor [N m], or none (default: of the robot's file, else 4)",
        type=limit,
        metavar="NM",
    )
    payload: float = option(0.0, "on the hip, beside the robot's own [kg]", metavar="KG")
    steps: int | None = option(None, "a walk of so many (default: one periodic step)", metavar="N")
    out: str | None = option(None, "where files go (default: runs/biped-OBJECTIVE)", metavar="DIR")
    min_normal: float = set_option(0.0, "least normal force [N]", metavar="N")
    zmp: bool = set_option(False, "keep the zero-moment point inside the foot")
    copper_loss: float | None = set_option(
        None,
        "of the objective energy [W/(N m)^2] (default: of the robot's file, else 0.5)",
        metavar="W",
    )
    reserve: float = set_option(
        0.0,
        "of the friction that the gait leaves unused; 0.02 lets the replay walk without a slip",
        metavar="SHARE",
    )
    start: float | None = set_option(
        None, "crank rate at the beginning of a walk [rad/s] (default: 0, rest)", metavar="RATE"
    )
    end: float | None = set_option(
        None, "crank rate at its end [rad/s], 0 for a stop (default: any)", metavar="RATE"
    )
    cells: int = set_option(200, "of the grid in each step", metavar="N")
    feedback: float = set_option(
        2.0, "of the second replay [1/rad]; the first one has none", metavar="GAIN"
    )
