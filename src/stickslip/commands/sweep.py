"""`stickslip sweep`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.commands import Outcome
from stickslip.commands.shared import players, tasks
from stickslip.parser import add_tables, completes

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

JSON = True
EXAMPLES = {
    "stickslip sweep biped --policy biped-ice crank-speed-pi --axis mu=0.03:0.3:10 "
    "--axis payload=0,5,10 --episodes 8 --out runs/mu": "two policies over frictions and loads",
    "stickslip sweep ugv --policy level-body --axis friction=0.05:0.4:4 --out runs/grip --json": (
        "a baseline over frictions, the summary as JSON"
    ),
}


def add_flags(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    """Whose policies, over which axes."""
    from stickslip.agents.registry import machine_among, machines
    from stickslip.agents.sweeps.flags import add_flags

    parser.add_argument(
        "machine",
        choices=[machine.name for machine in machines()],
        help="whose policies; each has axes of its own, see --help after its name",
    )
    add_tables(parser, add_flags(parser, machine_among(arguments)))
    completes(parser._option_string_actions.get("--policy"), players())
    completes(parser._option_string_actions.get("--task"), tasks())


def run(given: argparse.Namespace) -> Outcome:
    """Play every point."""
    from stickslip.agents.sweeps.command import sweep_command

    return Outcome(found=sweep_command(vars(given)))
