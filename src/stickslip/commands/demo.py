"""`stickslip demo`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.commands import Outcome

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

JSON = True
EXAMPLES = {
    "stickslip demo": "the biped on a floor too slippery for constant speed",
    "stickslip demo ugv --time-limit 120": "the UGV, with two minutes of training",
}


def add_flags(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    """Whose demo, where to, how long."""
    del arguments
    from stickslip.agents.registry import machines

    names = [machine.name for machine in machines()]
    parser.add_argument(
        "machine",
        nargs="?",
        choices=names,
        default=names[0],
        help="whose demo (default: %(default)s)",
    )
    parser.add_argument(
        "--out",
        metavar="DIR",
        default="runs",
        help="where its directory goes (default: %(default)s)",
    )
    parser.add_argument(
        "--fresh", action="store_true", help="train again, in a new directory beside the old one"
    )
    parser.add_argument(
        "--time-limit",
        type=float,
        metavar="SECONDS",
        help="stop training after so long and show how far it came (default: none)",
    )


def run(given: argparse.Namespace) -> Outcome:
    """Train and show."""
    from stickslip.agents.commands import demo_command

    return Outcome(found=demo_command(vars(given)))
