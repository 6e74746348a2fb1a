"""Errors and costs of the UGV's settings, which `stickslip.dynamics.ugv.recommendation` promises.

    python -m benchmarks.ugv [--quick] [--update] [--only PART ...] [--out FILE]
    python -m benchmarks.ugv --redraw

promise: errors and statuses of settings over random vehicles, ground and postures. costs: processor
time of a pose. Only the parts named are measured; the JSON keeps the other, with its commit.
--update also writes the module that `recommend` reads and the table of docs/drives.md;
--redraw does that without measuring.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.report import measured_by_command, put_between
from benchmarks.ugv import recommended
from benchmarks.ugv.costs import costs
from benchmarks.ugv.promise import promises
from stickslip.records.files import write_whole

RESULTS = Path("benchmarks/results/ugv.json")
DOCUMENT = Path("docs/drives.md")
DATA = Path("dynamics/ugv/measured.json")
PARTS: dict[str, Any] = {"promise": promises, "costs": costs}


def update(content: dict[str, Any]) -> None:
    """Write the data of `recommend` and the page's table."""
    write_whole(DATA, recommended.source(content))
    put_between(DOCUMENT, recommended.table(content))


def main(arguments: list[str] | None = None) -> None:
    """Run the command."""
    measured_by_command("ugv", __doc__, PARTS, update, arguments)


if __name__ == "__main__":
    main()
