"""`stickslip evaluate`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.commands import OK, Outcome
from stickslip.commands.shared import add_overwrite, add_scene, add_who, tasks
from stickslip.parser import completes

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

JSON = True
EXAMPLES = {
    "stickslip evaluate biped-ice crank-speed-pi": "a policy of the package beside a baseline",
    "stickslip evaluate crank-speed-pi --scene wet firm --payload 2": "on two floors, with a load",
    "stickslip evaluate --task UGVBump-v1 level-body --json": "scores, for a program to read",
}


def add_flags(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    """Add flags of players, task or scene, and episodes."""
    del arguments
    add_who(parser, many=True)
    parser.add_argument(
        "--episodes", type=int, help="for each (default: 32; of a task, those it was measured on)"
    )
    task = parser.add_argument(
        "--task",
        metavar="TASK",
        help="a task of `stickslip tasks`, in place of the policies' own: with scores and the gap",
    )
    completes(task, tasks())
    parser.add_argument(
        "--bound",
        action="store_true",
        help="UGV: also what no drive can beat, proved, some seconds to minutes an episode",
    )
    parser.add_argument(
        "--amplification",
        action="store_true",
        help="biped: also how many times a small difference of the start grows in an episode",
    )
    parser.add_argument("--out", metavar="DIR", help="write evaluation.csv and .json there")
    add_overwrite(parser, "what is in --out")
    add_scene(parser, many=True)


def run(given: argparse.Namespace) -> Outcome:
    """Play and compare."""
    from stickslip.agents.commands import evaluate_command

    return Outcome(OK, evaluate_command(vars(given)))
