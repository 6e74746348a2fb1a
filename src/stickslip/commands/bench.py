"""`stickslip bench`."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, cast

from stickslip.benchmarks import BENCHMARKS
from stickslip.commands import Outcome
from stickslip.parser import add_tables, completes

if TYPE_CHECKING:
    from collections.abc import Sequence

JSON = True
EXAMPLES = {
    "stickslip bench": "which there are, and which of them run here",
    "stickslip bench throughput --quick": "environment steps a second, in some minutes",
    "stickslip bench optimisers methods --json": "what one found, for a program to read",
    "stickslip bench suite --help": "the flags of one",
}


def add_flags(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    """Add the benchmark's name; all that follows it is its own."""
    del arguments
    name = parser.add_argument("name", nargs="?", metavar="NAME", help="one of those below")
    completes(name, BENCHMARKS)
    parser.add_argument(
        "rest", nargs=argparse.REMAINDER, action=_Rest, help="what the benchmark takes"
    )
    add_tables(parser, {"benchmarks": {name: one.about for name, one in BENCHMARKS.items()}})


def run(given: argparse.Namespace) -> Outcome:
    """List them, or run one."""
    from stickslip.benchmarks import list_benchmarks, run_benchmark

    if given.name is None:
        return Outcome(found=list_benchmarks())
    return Outcome(*run_benchmark(given.name, given.rest, as_json=given.json))


class _Rest(argparse.Action):
    """Words for the benchmark; --json among them is this command's, as before the name."""

    def __call__(
        self,
        parser: object,
        namespace: argparse.Namespace,
        values: object,
        option: object = None,
    ) -> None:
        del parser, option
        words = cast("Sequence[str]", values)
        namespace.rest = [one for one in words if one != "--json"]
        namespace.json = namespace.json or "--json" in words
