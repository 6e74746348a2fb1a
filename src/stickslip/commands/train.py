"""`stickslip train`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.commands.outcome import Outcome
from stickslip.commands.shared import tasks
from stickslip.parser import completes

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

JSON = False
EXAMPLES = {
    "stickslip train biped --task BipedFast-v0 --out runs/fast": "on a named task",
    "stickslip train biped --mu-static 0.1 --timesteps 200000 --seed 3": "a floor of one's own",
    "stickslip train ugv --tracks bump --out runs/legs": "the UGV's legs, over one ground",
    "stickslip train --out runs/fast --resume": "go on with a run that was cut off",
}


def add_flags(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    """The machine, the run, and every setting of the machine's configuration."""
    from stickslip.agents.registry import machine_among, machines
    from stickslip.agents.training.configuration import add_flags

    machine = machine_among(arguments)
    parser.add_argument(
        "machine",
        nargs="?",
        choices=[one.name for one in machines()],
        default=machine.name,
        help=f"what to train (default: {machines()[0].name}, or whose --task is); each has "
        "settings of its own, see --help after its name",
    )
    parser.add_argument(
        "--out", metavar="DIR", help="directory of the run (default: runs/<machine>-<time>)"
    )
    parser.add_argument("--resume", action="store_true", help="go on with the run in --out")
    parser.add_argument("--overwrite", action="store_true", help="begin the run in --out anew")
    parser.add_argument(
        "--no-pictures", action="store_true", help="no plots, no animation, no report.html"
    )
    parser.description = (
        f"{parser.description} The settings of train {machine.name} come after the options; "
        "config.json keeps them."
    )
    add_flags(parser, machine.configuration)
    completes(parser._option_string_actions.get("--task"), tasks())


def run(given: argparse.Namespace) -> Outcome:
    """Train."""
    from stickslip.agents.commands import train_command

    train_command(vars(given))
    return Outcome()
