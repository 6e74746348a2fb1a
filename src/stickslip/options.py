"""Flags and settings of `stickslip simulate`, `optimise` and `bench`; nothing heavy is imported."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stickslip.dynamics.names import SCENES, TRACKS
from stickslip.optim.gait import METHODS as GAIT_METHODS
from stickslip.optim.gait import OBJECTIVES
from stickslip.optim.posture import CRITERIA_IN_WORDS, METHODS, TREATMENTS
from stickslip.parser import Parser, add_overwrite, limit, truth

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
    add = parser.add_argument
    if machine == "biped":
        _add_walk(parser)
    else:
        about = "stations.csv of `stickslip optimise ugv`, or its directory"
        add("--posture", help=about)
        about = "instead: rear and front leg, held [degrees]; 90: straight down, more: outwards"
        add("--angles", type=float, nargs=2, help=about)
        _add_track(parser)
    rows = "walk.csv" if machine == "biped" else "drive.csv"
    add("--out", default=rows, help="rows with units, .csv")
    add("--plot", help="also a .png of the numbers")
    add("--film", help="also a film: .gif, .png (animated), .webp or .mp4")
    add_overwrite(parser)


def _add_walk(parser: Parser) -> None:
    """A walk of the biped under a torque."""
    add, put = parser.add_argument, parser.add_setting
    about = (
        "of the motor [N m], held for each --period: a number, a .csv of times and torques, or "
        "arithmetic, see below"
    )
    add("--torque", metavar="TORQUE", help=about)
    about = (
        "instead: crank rate [rad/s], a number or a .csv over time or crank angle, straight "
        "between the ends of each --period"
    )
    add("--rate", metavar="RATE", help=about)
    about = "to walk (default: 6, or the length of a file over time)"
    add("--seconds", type=float, help=about)
    about = "between two rows, for which a torque is held [s]"
    add("--period", type=float, default=0.02, help=about)
    add("--crank-rate", type=float, help="at the start [rad/s] (default: 0)")
    about = f"a floor: {', '.join(SCENES)} (default: {SCENES[0]})"
    add("--scene", choices=SCENES, metavar="NAME", help=about)
    several: dict[str, Any] = {"type": float, "nargs": "+"}
    add("--mu-static", **several, help="one floor instead, or one for each patch")
    add("--mu-kinetic", **several, help="kinetic friction (default: the static one)")
    add("--edges", **several, help="of patches, where friction changes [m]")
    add("--payload", type=float, help="mass on the hip, beside the robot's own [kg]")
    about = "fidelity, integrator, step and precision, see below"
    add("--setting", choices=tuple(SETTINGS), default="exact", metavar="NAME", help=about)
    put("phase", type=float, help="crank angle at the start [rad] (default: pi/2)")
    put("foot_velocity", type=float, default=0.0, help="at the start [m/s]")
    about = "also the 68 components of the joints' forces"
    put("joints", type=truth, default=False, help=about)
    add_machine(parser, "robot", "bars")
    parser.tables = {"names in a torque": NAMES, "settings": SETTINGS}


def _add_track(parser: Parser) -> None:
    """Ground, waypoints and limits of a drive."""
    add, put = parser.add_argument, parser.add_setting
    about = f"{', '.join(TRACKS)}, or a file of x and y or GPX"
    add("--track", default="bump", metavar="TRACK", help=about)
    about = "of the track, as often as needed: height=0.2; see below"
    how: dict[str, Any] = {"action": "append", "default": [], "metavar": "NAME=VALUE"}
    add("--track-option", dest="track_options", **how, help=about)
    about = "treatments of the file's points: merge,outliers=1,noise=0.2m,envelope; see below"
    add("--ground", metavar="NAME=LENGTH,...", help=about)
    about = "under the wheels where the track has no mu [-]"
    add("--friction", type=float, default=0.8, help=about)
    about = "of each wheel's motor [N m], or none (default: of the vehicle's file)"
    add("--max-torque", type=limit, help=about)
    put("leg_rate", type=limit, default=1.0, help="of a leg along the way [rad/m], or none")
    put("spacing", type=float, help="of waypoints [m] (default: 0.1)")
    put("start", type=float, help="first place of the front wheel [m]")
    put("end", type=float, help="last place of the front wheel [m]")
    add_machine(parser, "vehicle")
    parser.tables = TRACK_TABLES | {"criteria": CRITERIA_IN_WORDS}


def add_machine(parser: Parser, name: str, *parts: str) -> None:
    """A machine of one's own, and changes of it. parts: of its file besides its own and motor."""
    about = f"file in TOML; --set {name}.NAME=VALUE changes a number"
    parser.add_argument(f"--{name}", help=about)
    parser.add_parts("changes", (name, *parts, "motor"))


def optimise_flags(parser: Parser, machine: str) -> None:
    """Add the flags of an optimisation of the machine."""
    if machine == "biped":
        _add_gait(parser)
        out = "runs/biped-OBJECTIVE"
    else:
        _add_posture(parser)
        out = "runs/ugv-TRACK-CRITERION-METHOD"
    parser.add_argument("--out", metavar="DIR", help=f"directory (default: {out})")
    parser.add_argument("--no-pictures", dest="pictures", action="store_false", help="no plot")
    add_overwrite(parser, "the result in --out")


def _add_posture(parser: Parser) -> None:
    """A posture problem and the method that solves it."""
    add, put = parser.add_argument, parser.add_setting
    add("--criterion", default="wheel_energy", metavar="NAME", help="objective, see below")
    add("--method", default="dp", metavar="NAME", help="see below")
    add("--seed", type=int, help="of the method cma")
    _add_track(parser)
    about = "let the wheels overlap, as the chapter does; no vehicle can"
    put("overlap", type=truth, default=False, help=about)
    for name, place in (("start_angles", "first"), ("end_angles", "last")):
        about = f"rear and front leg at the {place} waypoint [rad] (default: any)"
        put(name, type=float, nargs=2, help=about)
    about = "of each leg on the grid (default: a grid that uses the leg rate)"
    put("angles", type=int, help=about)
    about = "let scp follow the grid's path (default: up to 2000 waypoints)"
    put("polish", type=truth, help=about)
    parser.tables |= {"methods": METHODS}


def _add_gait(parser: Parser) -> None:
    """A gait problem."""
    add, put = parser.add_argument, parser.add_setting
    about = "see below, or a sum: time=1,energy=0.2"
    add("--objective", default="time", metavar="NAME", help=about)
    about = "static friction, one number or one a step (default: the foot never slips)"
    add("--mu", type=float, nargs="+", help=about)
    add("--mean-rate", type=float, help="least mean crank rate [rad/s] (default: any)")
    about = "of the motor [N m], or none (default: of the robot's file, else 4)"
    add("--torque-limit", type=limit, help=about)
    add("--payload", type=float, default=0.0, help="on the hip, beside the robot's own [kg]")
    add("--steps", type=int, help="of a walk (default: one periodic step)")
    put("min_normal", type=float, default=0.0, help="least normal force [N]")
    about = "keep the zero-moment point inside the foot"
    put("zmp", type=truth, default=False, help=about)
    about = "for the energy [W/(N m)^2] (default: of the robot's file, else 0.5)"
    put("copper_loss", type=float, help=about)
    about = "share of friction left unused; 0.02 lets the replay walk without a slip"
    put("reserve", type=float, default=0.0, help=about)
    put("start", type=float, help="crank rate when a walk begins [rad/s] (default: 0)")
    put("end", type=float, help="crank rate when it ends, 0: a stop (default: any)")
    put("cells", type=int, default=200, help="of the grid in each step")
    about = "of the second replay [1/rad]; the first one has none"
    put("feedback", type=float, default=2.0, help=about)
    add_machine(parser, "robot", "bars")
    parser.tables = {"objectives": OBJECTIVES, "methods": GAIT_METHODS}


def bench_flags(parser: Parser, part: str) -> None:
    """Add the flags of a race, or of a report of races."""
    add = parser.add_argument
    if part == "report":
        add("source", nargs="+", help="directories of races")
        add("--out", required=True, metavar="DIR", help="a new directory")
    if part != "run":
        return
    add("--out", required=True, metavar="DIR", help="directory of the race")
    add("--methods", nargs="+", metavar="NAME", help="names (default: all)")
    add("--instances", nargs="+", metavar="ID", help="ids of the suite (default: all)")
    add("--budget", type=int, help="values and gradients of a run")
    add("--seconds", type=float, help="processor time of a run")
    add("--seeds", type=int, default=3, help="of each method on each instance")
    add("--resume", action="store_true", help="continue the race in --out")
    about = "time on the clock [s] after which a run is killed (default: %(default)s)"
    add("--limit", type=float, default=120.0, metavar="SECONDS", help=about)
    add("--workers", type=int, help="processes (default: cores)")
