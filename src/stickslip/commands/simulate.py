"""`stickslip simulate`."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from stickslip.commands import NOTHING_FOUND, OK, Outcome
from stickslip.commands.shared import add_overwrite

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

    from stickslip.parser import Parser
    from stickslip.simulate.flags import DriveFlags, WalkFlags

JSON = True
MACHINES = ("biped", "ugv")
EXAMPLES = {
    'stickslip simulate biped --torque "8 * (3 - crank_rate)" --crank-rate 3 --scene wet '
    "--period 0.005 --seconds 3 --plot walk.png": "a law for the torque: rows and a picture",
    "stickslip simulate biped --torque 0.9 --mu-static 0.5 0.05 0.5 --edges 0.1 0.3 "
    "--set kinetic_ratio=0.8 --seconds 0.9 --out ice.parquet": "a patch of ice",
    "stickslip simulate biped --torque walk.csv --crank-rate 3 --scene wet --period 0.005 "
    "--tolerance 1e-3 --json --out again.csv": "an earlier walk's torques, as exact as needed",
    "stickslip simulate ugv --angles 60 90 --track bump --plot drive.png": (
        "legs held still over a bump"
    ),
    "stickslip optimise ugv --track bump": "the drive of the least wheel energy",
    "stickslip simulate ugv --posture runs/ugv-bump-wheel_energy-dp --track bump --friction 0.5 "
    "--out slippery.csv": "that drive on worse ground",
}


def add_flags(parser: Parser, arguments: Sequence[str]) -> None:
    """Add the machine, its flags and the files."""
    from stickslip.simulate.flags import add_biped_flags, add_ugv_flags

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


def run(given: argparse.Namespace) -> Outcome:
    """Simulate; NOTHING_FOUND where the machine does not get to the end."""
    if given.machine == "biped":
        from stickslip.simulate.biped import simulate_biped_command

        whole, found = simulate_biped_command(cast("WalkFlags", vars(given)))
    else:
        from stickslip.simulate.ugv import simulate_ugv_command

        whole, found = simulate_ugv_command(cast("DriveFlags", vars(given)))
    return Outcome(OK if whole else NOTHING_FOUND, found)
