"""`stickslip bench`."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from stickslip.benchmarks import BENCHMARKS
from stickslip.commands.outcome import Outcome
from stickslip.parser import add_tables, completes

if TYPE_CHECKING:
    from collections.abc import Sequence

JSON = True
EXAMPLES = {
    "stickslip bench": "which there are, and which of them run here",
    "stickslip bench throughput --quick": "environment steps a second",
    "stickslip bench suite --help": "the flags of one",
}


def add_flags(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    """Which benchmark; all that follows its name is its own."""
    del arguments
    name = parser.add_argument("name", nargs="?", metavar="NAME", help="one of those below")
    completes(name, BENCHMARKS)
    parser.add_argument("rest", nargs=argparse.REMAINDER, help="what the benchmark takes")
    add_tables(parser, {"benchmarks": {name: one.about for name, one in BENCHMARKS.items()}})


def run(given: argparse.Namespace) -> Outcome:
    """List them, or run one."""
    from stickslip.benchmarks import list_benchmarks, run_benchmark

    if given.name is None:
        return Outcome(found=list_benchmarks())
    if given.json:
        raise ValueError("--json with a benchmark's name; accepted: for the list of them")
    return Outcome(run_benchmark(given.name, given.rest))
