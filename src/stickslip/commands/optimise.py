"""`stickslip optimise`."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from stickslip.commands import NOTHING_FOUND, OK, Outcome

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

    from stickslip.optimise.flags import GaitFlags
    from stickslip.parser import Parser

JSON = True
EXAMPLES = {
    "stickslip optimise ugv --track bump --track-option height=0.2 --max-torque 400": (
        "least wheel energy over a higher bump, with motors of 400 N m"
    ),
    "stickslip optimise biped --objective friction --mean-rate 3": (
        "the steady gait at 3 rad/s that asks least of the floor"
    ),
    "stickslip optimise biped --steps 4 --objective time --torque-limit 3 --mu 0.1 "
    "--set reserve=0.02 zmp=true --out runs/start": (
        "four steps from rest, as fast as 3 N m and the floor allow; as a replay, too, it holds"
    ),
}
MACHINES = ("ugv", "biped")


def add_flags(parser: Parser, arguments: Sequence[str]) -> None:
    """Add the machine and its flags."""
    from stickslip.optimise.flags import add_drive_flags, add_gait_flags

    parser.add_argument(
        "machine",
        choices=MACHINES,
        help="what to optimise: the UGV's leg angles or the biped's gait; each has flags of its "
        "own, see --help after its name",
    )
    named = next((word for word in arguments if word in MACHINES), MACHINES[0])
    (add_gait_flags if named == "biped" else add_drive_flags)(parser)


def run(given: argparse.Namespace) -> Outcome:
    """Solve; NOTHING_FOUND without a drive or gait."""
    if given.machine == "biped":
        from stickslip.optimise.gait_command import optimise_gait_command

        there, found = optimise_gait_command(cast("GaitFlags", vars(given)))
    else:
        from stickslip.optimise.command import optimise_command

        there, found = optimise_command(vars(given))
    return Outcome(OK if there else NOTHING_FOUND, found)
