"""Flags and settings of `stickslip simulate`; nothing heavy is imported."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypedDict

from stickslip.dynamics.names import SCENES
from stickslip.flags import add_columns, add_overwrite
from stickslip.optim.posture.names import CRITERIA_IN_WORDS
from stickslip.optimise.flags import add_limits, add_track, add_way, options_in_words
from stickslip.parser import add_tables, completes, truth
from stickslip.simulate.names import DTYPES, FIDELITIES, INTEGRATORS, SETTINGS

if TYPE_CHECKING:
    import argparse
    from collections.abc import Mapping, Sequence

    from stickslip.parser import Parser


class WalkFlags(TypedDict):
    """The flags as they are read."""

    torque: str
    columns: str | None
    seconds: float | None
    period: float
    phase: float | None
    crank_rate: float
    foot_velocity: float
    one_step: bool
    scene: str | None
    mu_static: list[float] | None
    mu_kinetic: list[float] | None
    kinetic_ratio: float | None
    edges: list[float] | None
    payload: float | None
    setting: str | None
    tolerance: float | None
    fidelity: str | None
    integrator: str | None
    step: float | None
    dtype: str | None
    joints: bool
    out: str
    plot: str | None
    overwrite: bool


NAMES = {
    "t": "time [s]",
    "phase": "crank angle of the supporting leg, pi/2 to 3 pi/2 [rad]",
    "crank_angle": "the same without wrapping [rad]",
    "crank_rate": "[rad/s]",
    "foot_position, foot_velocity": "of the foot over the floor, forwards [m], [m/s]",
    "steps": "exchanges of support so far",
}


def add_biped_flags(parser: Parser) -> None:
    """The torque, the walk, the floor, how it is computed, and the files."""
    parser.add_argument(
        "--torque",
        required=True,
        metavar="TORQUE",
        help="of the motor [N m]: a number, a .csv or .npy of times and torques, or arithmetic, "
        "see below; held for each --period",
    )
    add_columns(parser, "a file of torques", "time=t_s,torque=motor")
    _add_walk(parser.add_argument_group("walk"))
    _add_floor(parser.add_argument_group("floor and load"))
    _add_method(parser.add_argument_group("how it is computed"))
    _add_settings(parser)
    tables: dict[str, Mapping[str, str]] = {
        "names in a torque": NAMES,
        "settings": SETTINGS,
        "fidelities": FIDELITIES,
        "integrators": INTEGRATORS,
    }
    add_tables(parser, tables)


def _add_walk(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--seconds",
        type=float,
        help="to walk (default: 6, of a file of torques as long as it goes)",
    )
    group.add_argument(
        "--period",
        type=float,
        default=0.02,
        metavar="S",
        help="between two rows, for which a torque is held [s] (default: %(default)s)",
    )
    group.add_argument(
        "--crank-rate",
        type=float,
        default=0.0,
        metavar="RATE",
        help="at the start [rad/s] (default: %(default)s)",
    )


def _add_floor(group: argparse._ArgumentGroup) -> None:
    scene = group.add_argument(
        "--scene",
        choices=SCENES,
        metavar="NAME",
        help=f"a floor by name: {', '.join(SCENES)} (default: {SCENES[0]})",
    )
    completes(scene, SCENES)
    group.add_argument(
        "--mu-static",
        type=float,
        nargs="+",
        metavar="MU",
        help="one floor instead, or one number for each patch between --edges",
    )
    group.add_argument(
        "--mu-kinetic",
        type=float,
        nargs="+",
        metavar="MU",
        help="kinetic friction of the same (default: the static one)",
    )
    group.add_argument(
        "--edges", type=float, nargs="+", metavar="M", help="where friction changes [m]"
    )
    group.add_argument("--payload", type=float, metavar="KG", help="mass on the hip [kg]")


def _add_method(group: argparse._ArgumentGroup) -> None:
    setting = group.add_argument(
        "--setting",
        choices=tuple(SETTINGS),
        metavar="NAME",
        help="fidelity, integrator, step and precision, see below (default: exact)",
    )
    completes(setting, SETTINGS)
    group.add_argument(
        "--tolerance",
        type=float,
        metavar="RATE",
        help="instead: the cheapest measured setting whose error stays below so much in each "
        "simulated second [rad/s], as `recommend` finds it",
    )


def _add_settings(parser: Parser) -> None:
    parser.add_setting(
        "phase",
        type=float,
        metavar="RAD",
        help="crank angle of the supporting leg at the start, pi/2 to 3 pi/2 (default: pi/2)",
    )
    parser.add_setting(
        "foot_velocity",
        type=float,
        default=0.0,
        metavar="SPEED",
        help="at the start [m/s] (default: %(default)s)",
    )
    parser.add_setting(
        "one_step", type=truth, default=False, help="end at the first exchange of support"
    )
    parser.add_setting(
        "kinetic_ratio",
        type=float,
        metavar="SHARE",
        help="kinetic friction as a share of the static one, 0 to 1, instead of --mu-kinetic",
    )
    for name, known in (("fidelity", FIDELITIES), ("integrator", INTEGRATORS)):
        parser.add_setting(
            name, choices=tuple(known), metavar="NAME", help=f"{', '.join(known)}, see below"
        )
    parser.add_setting(
        "step",
        type=float,
        metavar="S",
        help="the integrator's longest step [s] (default: the setting's; with integrator= 0.005)",
    )
    parser.add_setting(
        "dtype", choices=DTYPES, metavar="NAME", help=f"precision: {', '.join(DTYPES)}"
    )
    parser.add_setting(
        "joints",
        type=truth,
        default=False,
        help="also the 68 components of the joints' forces",
    )


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


MACHINES = ("biped", "ugv")


def add_flags(parser: Parser, arguments: Sequence[str]) -> None:
    """Add the machine and its flags."""
    parser.add_argument(
        "machine",
        choices=MACHINES,
        help="what to simulate; each has flags of its own, see --help after its name",
    )
    named = next((word for word in arguments if word in MACHINES), MACHINES[0])
    data = "walk.csv" if named == "biped" else "drive.csv"
    parser.add_argument(
        "--out",
        metavar="FILE",
        default=data,
        help="rows with units, .csv or .parquet (default: %(default)s)",
    )
    parser.add_argument("--plot", metavar="FILE", help="also a .png")
    add_overwrite(parser)
    (add_biped_flags if named == "biped" else add_ugv_flags)(parser)
