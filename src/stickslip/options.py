"""Flags and settings of `stickslip simulate`, `optimise` and `bench`; nothing heavy is imported."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from stickslip.dynamics.names import SCENES, TRACKS
from stickslip.optim.gait import METHODS as GAIT_METHODS
from stickslip.optim.gait import OBJECTIVES
from stickslip.optim.posture import CRITERIA_IN_WORDS, METHODS, TREATMENTS
from stickslip.parser import add_options, changes_option, limit, option, set_option

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.parser import Parser

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
TRACK_TABLES: dict[str, Mapping[str, str]] = {
    "track options": {name: ", ".join(words) for name, words in TRACK_OPTIONS.items()}
    | {"a file": "interpolation"},
    "treatments of ground": TREATMENTS,
}
SETTINGS = {
    "fast": "a table and steps of 5 ms in single precision",
    "balanced": "a table and steps of 2.5 ms in single precision",
    "exact": "every switch located by an adaptive method in double precision",
}
"""The presets of stickslip.dynamics.PRESETS."""
FIDELITIES = ("joint", "reduced", "table", "chebyshev", "paper")
INTEGRATORS = ("euler", "rk4_split", "event_exact")
"""The names of stickslip.dynamics.biped.FIDELITIES and INTEGRATORS; docs/design.md."""
NAMES = {
    "t": "time [s]",
    "phase": "crank angle of the supporting leg, pi/2 to 3 pi/2 [rad]",
    "crank_angle": "the same without wrapping [rad]",
    "crank_rate": "[rad/s]",
    "foot_position, foot_velocity": "of the foot over the floor, forwards [m], [m/s]",
    "steps": "exchanges of support so far",
}


def simulate_flags(parser: Parser, machine: str) -> None:
    """Add the flags of a simulation of the machine."""
    if machine == "biped":
        add_options(parser, WalkOptions)
        parser.tables = {"names in a torque": NAMES, "settings": SETTINGS}
    else:
        add_options(parser, DriveOptions)
        parser.tables = TRACK_TABLES | {"criteria": CRITERIA_IN_WORDS}


def optimise_flags(parser: Parser, machine: str) -> None:
    """Add the flags of an optimisation of the machine."""
    if machine == "biped":
        add_options(parser, GaitOptions)
        parser.tables = {"objectives": OBJECTIVES, "methods": GAIT_METHODS}
    else:
        add_options(parser, PostureOptions)
        parser.tables = TRACK_TABLES | {"criteria": CRITERIA_IN_WORDS, "methods": METHODS}


def bench_flags(parser: Parser, part: str) -> None:
    """Add the flags of a race, or of a report of races."""
    if part == "run":
        add_options(parser, RaceOptions)
    elif part == "report":
        parser.add_argument("source", nargs="+", help="directories of races, tables of others")
        parser.add_argument("--out", required=True, metavar="DIR", help="a new directory")


@dataclass(frozen=True)
class RobotOptions:
    """A robot of one's own."""

    robot: str | None = option(None, "file in TOML; --set robot.NAME=VALUE changes a number")
    changes: dict[str, str] = changes_option("robot", "bars", "motor")


@dataclass(frozen=True)
class VehicleOptions:
    """A vehicle of one's own."""

    vehicle: str | None = option(None, "file in TOML; --set vehicle.NAME=VALUE changes a number")
    changes: dict[str, str] = changes_option("vehicle", "motor")


@dataclass(frozen=True)
class TrackOptions(VehicleOptions):
    """Ground, waypoints and limits of a drive."""

    track: str = option(
        "bump", f"{', '.join(TRACKS)}, or a file of x and y or GPX", metavar="TRACK"
    )
    track_options: list[str] = option(
        [],
        "of the track, as often as needed: height=0.2; see below",
        flag="--track-option",
        action="append",
        metavar="NAME=VALUE",
    )
    ground: str | None = option(
        None,
        "treatments of the file's points: merge,outliers=1,noise=0.2m,envelope; see below",
        metavar="NAME=LENGTH,...",
    )
    friction: float = option(0.8, "under the wheels where the track has no mu [-]")
    max_torque: float | None = option(
        None, "of each wheel's motor [N m], or none (default: of the vehicle's file)", type=limit
    )
    leg_rate: float | None = set_option(1.0, "of a leg along the way [rad/m], or none", type=limit)
    spacing: float | None = set_option(None, "of waypoints [m] (default: 0.1)")
    start: float | None = set_option(None, "first place of the front wheel [m]")
    end: float | None = set_option(None, "last place of the front wheel [m]")


@dataclass(frozen=True)
class SimulationFiles:
    """Files of a simulation."""

    out: str = option("simulation.csv", "rows with units, .csv")
    plot: str | None = option(None, "also a .png of the numbers")
    film: str | None = option(None, "also a film: .gif, .png (animated), .webp or .mp4")
    overwrite: bool = option(False, "replace the files")


@dataclass(frozen=True)
class WalkOptions(RobotOptions, SimulationFiles):
    """A walk of the biped under a torque."""

    torque: str | None = option(
        None,
        "of the motor [N m], held for each --period: a number, a .csv of times and torques, or "
        "arithmetic, see below",
        metavar="TORQUE",
    )
    rate: str | None = option(
        None,
        "instead: crank rate [rad/s], a number or a .csv over time or crank angle, straight "
        "between the ends of each --period",
        metavar="RATE",
    )
    out: str = option("walk.csv", "rows with units, .csv")
    seconds: float | None = option(None, "to walk (default: 6, or the length of a file over time)")
    period: float = option(0.02, "between two rows, for which a torque is held [s]")
    crank_rate: float | None = option(None, "at the start [rad/s] (default: 0)")
    scene: str | None = option(
        None,
        f"a floor: {', '.join(SCENES)} (default: {SCENES[0]})",
        choices=SCENES,
        metavar="NAME",
    )
    mu_static: list[float] | None = option(None, "one floor instead, or one for each patch")
    mu_kinetic: list[float] | None = option(None, "kinetic friction (default: the static one)")
    edges: list[float] | None = option(None, "of patches, where friction changes [m]")
    payload: float | None = option(None, "mass on the hip, beside the robot's own [kg]")
    setting: str = option(
        "exact",
        "fidelity, integrator, step and precision, see below",
        choices=tuple(SETTINGS),
        metavar="NAME",
    )
    phase: float | None = set_option(None, "crank angle at the start [rad] (default: pi/2)")
    foot_velocity: float = set_option(0.0, "at the start [m/s]")
    fidelity: str | None = set_option(None, ", ".join(FIDELITIES), choices=FIDELITIES)
    integrator: str | None = set_option(None, ", ".join(INTEGRATORS), choices=INTEGRATORS)
    step: float | None = set_option(
        None, "longest step [s] (default: the setting's; with integrator= 0.005)"
    )
    joints: bool = set_option(False, "also the 68 components of the joints' forces")


@dataclass(frozen=True)
class DriveOptions(TrackOptions, SimulationFiles):
    """A drive of the UGV with given leg angles, from a file or held (with waypoints)."""

    posture: str | None = option(None, "stations.csv of `stickslip optimise ugv`, or its directory")
    angles: tuple[float, float] | None = option(
        None, "instead: rear and front leg, held [degrees]; 90: straight down, more: outwards"
    )
    out: str = option("drive.csv", "rows with units, .csv")


@dataclass(frozen=True)
class ResultFiles:
    """Files of an optimisation."""

    overwrite: bool = option(False, "replace the result in --out")
    pictures: bool = option(True, "no plot")


@dataclass(frozen=True)
class PostureOptions(TrackOptions, ResultFiles):
    """A posture problem and the method that solves it."""

    criterion: str = option("wheel_energy", "objective, see below", metavar="NAME")
    method: str = option("dp", "see below", metavar="NAME")
    seed: int | None = option(None, "of the method cma")
    out: str | None = option(None, "directory (default: runs/ugv-TRACK-CRITERION-METHOD)")
    overlap: bool = set_option(False, "let the wheels overlap, as the chapter does; no vehicle can")
    start_angles: tuple[float, float] | None = set_option(
        None, "rear and front leg at the first waypoint [rad] (default: any)"
    )
    end_angles: tuple[float, float] | None = set_option(
        None, "rear and front leg at the last waypoint [rad] (default: any)"
    )
    angles: int | None = set_option(
        None, "of each leg on the grid (default: a grid that uses the leg rate)"
    )
    polish: bool | None = set_option(
        None, "let scp follow the grid's path (default: up to 2000 waypoints)"
    )


@dataclass(frozen=True)
class GaitOptions(RobotOptions, ResultFiles):
    """A gait problem."""

    objective: str = option("time", "see below, or a sum: time=1,energy=0.2", metavar="NAME")
    mu: list[float] | None = option(
        None, "static friction, one number or one a step (default: the foot never slips)"
    )
    mean_rate: float | None = option(None, "least mean crank rate [rad/s] (default: any)")
    torque_limit: float | None = option(
        None, "of the motor [N m], or none (default: of the robot's file, else 4)", type=limit
    )
    payload: float = option(0.0, "on the hip, beside the robot's own [kg]")
    steps: int | None = option(None, "of a walk (default: one periodic step)")
    out: str | None = option(None, "directory (default: runs/biped-OBJECTIVE)")
    min_normal: float = set_option(0.0, "least normal force [N]")
    zmp: bool = set_option(False, "keep the zero-moment point inside the foot")
    copper_loss: float | None = set_option(
        None, "for the energy [W/(N m)^2] (default: of the robot's file, else 0.5)"
    )
    reserve: float = set_option(
        0.0, "share of friction left unused; 0.02 lets the replay walk without a slip"
    )
    start: float | None = set_option(None, "crank rate when a walk begins [rad/s] (default: 0)")
    end: float | None = set_option(None, "crank rate when it ends, 0: a stop (default: any)")
    cells: int = set_option(200, "of the grid in each step")
    feedback: float = set_option(2.0, "of the second replay [1/rad]; the first one has none")


@dataclass(frozen=True)
class RaceOptions:
    """Options of a race, see agents.optimisers.racing.race."""

    out: str = option(about="directory of the race", metavar="DIR")
    methods: list[str] | None = option(None, "names (default: all)", metavar="NAME")
    instances: list[str] | None = option(None, "ids of the suite (default: all)", metavar="ID")
    budget: int | None = option(None, "values and gradients of a run")
    seconds: float | None = option(None, "processor time of a run")
    seeds: int = option(3, "of each method on each instance")
    limit: float = option(120.0, "time on the clock, after which a run is killed [s]")
    resume: bool = option(False, "continue the race in --out")
    workers: int | None = option(None, "processes (default: cores)")
