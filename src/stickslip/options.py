"""Flags and settings of `stickslip simulate`, `optimise` and `bench`; nothing heavy is imported."""

from __future__ import annotations

from collections.abc import Mapping

from stickslip.dynamics.names import SCENES, TRACKS
from stickslip.optim.gait import METHODS as GAIT_METHODS
from stickslip.optim.gait import OBJECTIVES
from stickslip.optim.posture import CRITERIA_IN_WORDS, METHODS, TREATMENTS
from stickslip.parser import Parser, limit, truth

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
    add, rows = parser.add, "walk.csv"
    if machine == "biped":
        _add_walk(parser)
    else:
        rows = "drive.csv"
        add("--posture", "stations.csv of `stickslip optimise ugv`, or its directory")
        about = "instead: rear and front leg, held [degrees]; 90: straight down, more: outwards"
        add("--angles", about, type=float, nargs=2)
        _add_track(parser)
    add("--out", "rows with units, .csv", default=rows)
    add("--plot", "also a .png of the numbers")
    add("--film", "also a film: .gif, .png (animated), .webp or .mp4")
    add("--overwrite", "replace the files", action="store_true")


def _add_walk(parser: Parser) -> None:
    """A walk of the biped under a torque."""
    add, put = parser.add, parser.put
    about = (
        "of the motor [N m], held for each --period: a number, a .csv of times and torques, or "
        "arithmetic, see below"
    )
    add("--torque TORQUE", about)
    about = (
        "instead: crank rate [rad/s], a number or a .csv over time or crank angle, straight "
        "between the ends of each --period"
    )
    add("--rate RATE", about)
    add("--seconds", "to walk (default: 6, or the length of a file over time)", type=float)
    about = "between two rows, for which a torque is held [s]"
    add("--period", about, type=float, default=0.02)
    add("--crank-rate", "at the start [rad/s] (default: 0)", type=float)
    about = f"a floor: {', '.join(SCENES)} (default: {SCENES[0]})"
    add("--scene NAME", about, choices=SCENES)
    add("--mu-static", "one floor instead, or one for each patch", type=float, nargs="+")
    add("--mu-kinetic", "kinetic friction (default: the static one)", type=float, nargs="+")
    add("--edges", "of patches, where friction changes [m]", type=float, nargs="+")
    add("--payload", "mass on the hip, beside the robot's own [kg]", type=float)
    about = "fidelity, integrator, step and precision, see below"
    add("--setting NAME", about, choices=tuple(SETTINGS), default="exact")
    put("phase", "crank angle at the start [rad] (default: pi/2)", type=float)
    put("foot_velocity", "at the start [m/s]", type=float, default=0.0)
    put("joints", "also the 68 components of the joints' forces", type=truth, default=False)
    add_machine(parser, "robot", "bars")
    parser.tables = {"names in a torque": NAMES, "settings": SETTINGS}


def _add_track(parser: Parser) -> None:
    """Ground, waypoints and limits of a drive."""
    add, put = parser.add, parser.put
    add("--track TRACK", f"{', '.join(TRACKS)}, or a file of x and y or GPX", default="bump")
    about = "of the track, as often as needed: height=0.2; see below"
    add("--track-option NAME=VALUE", about, dest="track_options", action="append", default=[])
    about = "treatments of the file's points: merge,outliers=1,noise=0.2m,envelope; see below"
    add("--ground NAME=LENGTH,...", about)
    add("--friction", "under the wheels where the track has no mu [-]", type=float, default=0.8)
    about = "of each wheel's motor [N m], or none (default: of the vehicle's file)"
    add("--max-torque", about, type=limit)
    put("leg_rate", "of a leg along the way [rad/m], or none", type=limit, default=1.0)
    put("spacing", "of waypoints [m] (default: 0.1)", type=float)
    put("start", "first place of the front wheel [m]", type=float)
    put("end", "last place of the front wheel [m]", type=float)
    add_machine(parser, "vehicle")
    parser.tables = TRACK_TABLES | {"criteria": CRITERIA_IN_WORDS}


def add_machine(parser: Parser, name: str, *parts: str) -> None:
    """A machine of one's own, and changes of it. parts: of its file besides its own and motor."""
    parser.add(f"--{name}", f"file in TOML; --set {name}.NAME=VALUE changes a number")
    parser.add_parts("changes", (name, *parts, "motor"))


def optimise_flags(parser: Parser, machine: str) -> None:
    """Add the flags of an optimisation of the machine."""
    if machine == "biped":
        _add_gait(parser)
        out = "runs/biped-OBJECTIVE"
    else:
        _add_posture(parser)
        out = "runs/ugv-TRACK-CRITERION-METHOD"
    parser.add("--out DIR", f"directory (default: {out})")
    parser.add("--no-pictures", "no plot", dest="pictures", action="store_false")
    parser.add("--overwrite", "replace the result in --out", action="store_true")


def _add_posture(parser: Parser) -> None:
    """A posture problem and the method that solves it."""
    add, put = parser.add, parser.put
    add("--criterion NAME", "objective, see below", default="wheel_energy")
    add("--method NAME", "see below", default="dp")
    add("--seed", "of the method cma", type=int)
    _add_track(parser)
    about = "let the wheels overlap, as the chapter does; no vehicle can"
    put("overlap", about, type=truth, default=False)
    for name, place in (("start_angles", "first"), ("end_angles", "last")):
        about = f"rear and front leg at the {place} waypoint [rad] (default: any)"
        put(name, about, type=float, nargs=2)
    put("angles", "of each leg on the grid (default: a grid that uses the leg rate)", type=int)
    put("polish", "let scp follow the grid's path (default: up to 2000 waypoints)", type=truth)
    parser.tables |= {"methods": METHODS}


def _add_gait(parser: Parser) -> None:
    """A gait problem."""
    add, put = parser.add, parser.put
    add("--objective NAME", "see below, or a sum: time=1,energy=0.2", default="time")
    about = "static friction, one number or one a step (default: the foot never slips)"
    add("--mu", about, type=float, nargs="+")
    add("--mean-rate", "least mean crank rate [rad/s] (default: any)", type=float)
    about = "of the motor [N m], or none (default: of the robot's file, else 4)"
    add("--torque-limit", about, type=limit)
    add("--payload", "on the hip, beside the robot's own [kg]", type=float, default=0.0)
    add("--steps", "of a walk (default: one periodic step)", type=int)
    put("min_normal", "least normal force [N]", type=float, default=0.0)
    put("zmp", "keep the zero-moment point inside the foot", type=truth, default=False)
    about = "for the energy [W/(N m)^2] (default: of the robot's file, else 0.5)"
    put("copper_loss", about, type=float)
    about = "share of friction left unused; 0.02 lets the replay walk without a slip"
    put("reserve", about, type=float, default=0.0)
    put("start", "crank rate when a walk begins [rad/s] (default: 0)", type=float)
    put("end", "crank rate when it ends, 0: a stop (default: any)", type=float)
    put("cells", "of the grid in each step", type=int, default=200)
    put("feedback", "of the second replay [1/rad]; the first one has none", type=float, default=2.0)
    add_machine(parser, "robot", "bars")
    parser.tables = {"objectives": OBJECTIVES, "methods": GAIT_METHODS}


def bench_flags(parser: Parser, part: str) -> None:
    """Add the flags of a race, or of a report of races."""
    add = parser.add
    if part == "report":
        add("source", "directories of races", nargs="+")
        add("--out DIR", "a new directory", required=True)
    if part != "run":
        return
    add("--out DIR", "directory of the race", required=True)
    add("--methods NAME", "names (default: all)", nargs="+")
    add("--instances ID", "ids of the suite (default: all)", nargs="+")
    add("--budget", "values and gradients of a run", type=int)
    add("--seconds", "processor time of a run", type=float)
    add("--seeds", "of each method on each instance", type=int, default=3)
    add("--resume", "continue the race in --out", action="store_true")
    about = "time on the clock [s] after which a run is killed (default: %(default)s)"
    add("--limit SECONDS", about, type=float, default=120.0)
    add("--workers", "processes (default: cores)", type=int)
