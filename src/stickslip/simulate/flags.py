"""Flags and settings of `stickslip simulate`; nothing heavy is imported."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from stickslip.dynamics.names import SCENES
from stickslip.optim.posture import CRITERIA_IN_WORDS
from stickslip.optimise.flags import TRACK_TABLE, RobotOptions, TrackOptions
from stickslip.parser import add_options, add_tables, option, set_option

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.parser import Parser

MACHINES = {"biped": "a walk under a torque", "ugv": "a drive with given leg angles"}
SETTINGS = {
    "fast": "a table and steps of 5 ms in single precision",
    "balanced": "a table and steps of 2.5 ms in single precision",
    "exact": "every switch located by an adaptive method in double precision",
}
"""The presets of stickslip.dynamics.PRESETS."""
FIDELITIES = {
    "joint": "the 72 equations of all bodies, solved at every call",
    "reduced": "exact inertia functions, by differentiating the closed linkage",
    "table": "polynomials fitted to the exact ones, piece by piece",
    "chebyshev": "one series over the support phase",
    "paper": "the chapter's: forward differences in the crank angle",
}
INTEGRATORS = {
    "euler": "the chapter's: accelerations constant during a step",
    "semi_implicit": "velocities first, positions with the new ones",
    "rk4": "Runge-Kutta in one mode a step",
    "rk4_split": "the same, split at every switching instant",
    "event_exact": "adaptive, every switching instant located to the tolerance",
}
"""The names of stickslip.dynamics.biped.FIDELITIES and INTEGRATORS."""
DTYPES = ("float32", "float64")
STATUS = {
    "OK": "the whole time was walked",
    "SLIP_ONSET": "the whole time was walked; the foot slipped",
    "TOPPLE": "it falls: the zero-moment point leaves the foot",
    "LIFT_OFF": "it falls: the ground would have to pull at the foot",
    "RUNAWAY": "the crank turns faster than the greatest rate that was given",
    "NO_SOLUTION": "the equations have no unique solution here (Painlevé), or the linkage does not "
    "close",
    "NON_FINITE": "a number overflowed or is none, the torque's perhaps",
    "STEP_COMPLETE": "the one step was walked to the exchange of support",
    "NO_EXCHANGE": "support cannot be handed over without an impact",
    "NOT_CONVERGED": "the integrator's steps are too few or too long; the numbers end there",
    "HOLLOW_GROUND": "the ground is hollower than a wheel",
    "ROLLOVER": "it rolls over: the ground would have to pull at a wheel",
    "GROUNDED": "the body or a leg touches the ground",
    "WHEEL_SLIP": "a wheel slips: it needs more friction than there is",
    "OVERLOAD": "a wheel needs more torque than its motor gives",
    "OVERLAP": "the wheels overlap: the legs are folded too far",
}
"""Meaning of each Status for a simulation."""
NAMES = {
    "t": "time [s]",
    "phase": "crank angle of the supporting leg, pi/2 to 3 pi/2 [rad]",
    "crank_angle": "the same without wrapping [rad]",
    "crank_rate": "[rad/s]",
    "foot_position, foot_velocity": "of the foot over the floor, forwards [m], [m/s]",
    "steps": "exchanges of support so far",
}
FLOOR, METHOD = "floor and load", "how it is computed"


def add_flags(parser: Parser, arguments: Sequence[str]) -> None:
    """Add the machine and its flags."""
    if not parser.add_machine(MACHINES, arguments):
        return
    if "biped" in arguments:
        add_options(parser, WalkOptions)
        tables = {"settings": SETTINGS, "fidelities": FIDELITIES, "integrators": INTEGRATORS}
        add_tables(parser, {"names in a torque": NAMES} | tables)
    else:
        add_options(parser, DriveOptions)
        add_tables(parser, TRACK_TABLE | {"criteria": CRITERIA_IN_WORDS})


@dataclass(frozen=True)
class Output:
    """Files of a simulation."""

    out: str = option("simulation.csv", "rows with units, .csv or .parquet", metavar="FILE")
    plot: str | None = option(None, "also a .png of the numbers", metavar="FILE")
    film: str | None = option(
        None, "also a film of the motion: .gif, .png (animated), .webp or .mp4", metavar="FILE"
    )
    overwrite: bool = option(False, "replace the files")


@dataclass(frozen=True)
class WalkOptions(RobotOptions, Output):
    """A walk of the biped under a torque."""

    torque: str = option(
        about="of the motor [N m]: a number, a .csv of times and torques, or arithmetic, see "
        "below; held for each --period",
        metavar="TORQUE",
    )
    columns: str | None = option(
        None,
        "the columns of a file of torques whose heads are other names: time=t_s,torque=motor",
        metavar="NAME=HEAD,...",
    )
    out: str = option("walk.csv", "rows with units, .csv or .parquet", metavar="FILE")
    seconds: float | None = option(
        None, "to walk (default: 6, of a file of torques as long as it goes)", group="walk"
    )
    period: float = option(
        0.02, "between two rows, for which a torque is held [s]", group="walk", metavar="S"
    )
    crank_rate: float = option(0.0, "at the start [rad/s]", group="walk", metavar="RATE")
    scene: str | None = option(
        None,
        f"a floor by name: {', '.join(SCENES)} (default: {SCENES[0]})",
        group=FLOOR,
        choices=SCENES,
        metavar="NAME",
        names=SCENES,
    )
    mu_static: list[float] | None = option(
        None,
        "one floor instead, or one number for each patch between --edges",
        group=FLOOR,
        metavar="MU",
    )
    mu_kinetic: list[float] | None = option(
        None, "kinetic friction of the same (default: the static one)", group=FLOOR, metavar="MU"
    )
    edges: list[float] | None = option(None, "where friction changes [m]", group=FLOOR, metavar="M")
    payload: float | None = option(
        None, "mass on the hip, beside the robot's own [kg]", group=FLOOR, metavar="KG"
    )
    setting: str | None = option(
        None,
        "fidelity, integrator, step and precision, see below (default: exact)",
        flag="--setting",
        group=METHOD,
        choices=tuple(SETTINGS),
        metavar="NAME",
        names=SETTINGS,
    )
    tolerance: float | None = option(
        None,
        "instead: the cheapest measured setting whose error stays below so much in each "
        "simulated second [rad/s], as `recommend` finds it",
        group=METHOD,
        metavar="RATE",
    )
    phase: float | None = set_option(
        None,
        "crank angle of the supporting leg at the start, pi/2 to 3 pi/2 (default: pi/2)",
        metavar="RAD",
    )
    foot_velocity: float = set_option(0.0, "at the start [m/s]", metavar="SPEED")
    one_step: bool = set_option(False, "end at the first exchange of support")
    fidelity: str | None = set_option(
        None, f"{', '.join(FIDELITIES)}, see below", choices=tuple(FIDELITIES), metavar="NAME"
    )
    integrator: str | None = set_option(
        None, f"{', '.join(INTEGRATORS)}, see below", choices=tuple(INTEGRATORS), metavar="NAME"
    )
    step: float | None = set_option(
        None,
        "the integrator's longest step [s] (default: the setting's; with integrator= 0.005)",
        metavar="S",
    )
    dtype: str | None = set_option(
        None, f"precision: {', '.join(DTYPES)}", choices=DTYPES, metavar="NAME"
    )
    joints: bool = set_option(False, "also the 68 components of the joints' forces")


@dataclass(frozen=True)
class DriveOptions(TrackOptions, Output):
    """A drive of the UGV with given leg angles, from a file or held (with waypoints)."""

    posture: str | None = option(
        None,
        "stations.csv of `stickslip optimise ugv`, or its directory: places and leg angles",
        metavar="FILE",
    )
    angles: tuple[float, float] | None = option(
        None,
        "instead: rear and front leg, held [degrees]: 90 is straight down, more is outwards",
        metavar="DEG",
    )
    out: str = option("drive.csv", "rows with units, .csv or .parquet", metavar="FILE")
