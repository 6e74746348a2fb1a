"""Errors and costs of the UGV's settings, which `stickslip.dynamics.ugv.recommendation` promises.

    python -m benchmarks.ugv [--quick] [--update] [--only PART ...] [--out FILE]
    python -m benchmarks.ugv --redraw

promise: errors and statuses of settings over random vehicles, ground and postures. costs: processor
time of a pose. Only the parts named are measured; the JSON keeps the other, with its commit.
--update also writes the module that `recommend` reads and the table of docs/ugv_tradeoff.md;
--redraw does that without measuring.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.report import measured_parts, options, put_between, read_json
from benchmarks.ugv import recommended
from benchmarks.ugv.costs import costs
from benchmarks.ugv.promise import promises
from stickslip.records.files import write_whole

RESULTS = Path("benchmarks/results/ugv.json")
DOCUMENT = Path("docs/ugv_tradeoff.md")
DATA = Path("dynamics/ugv/measured.json")
PARTS: dict[str, Any] = {"promise": promises, "costs": costs}


def main(arguments: list[str] | None = None) -> None:
    """Measure, print, write the files."""
    parser = options("ugv", __doc__, RESULTS)
    parser.add_argument("--quick", action="store_true", help="a few of each")
    parser.add_argument("--update", action="store_true", help="also data and table")
    parser.add_argument("--redraw", action="store_true", help="write all from the JSON there is")
    parser.add_argument("--only", nargs="+", choices=list(PARTS), default=list(PARTS))
    given = parser.parse_args(arguments)
    content = read_json(given.out)
    if not given.redraw:
        asked = {name: PARTS[name] for name in given.only}
        content = measured_parts(asked, list(PARTS), given.quick, given.out)
    if given.update or given.redraw:
        write_whole(DATA, recommended.source(content))
        put_between(DOCUMENT, recommended.table(content))
        print(f"Written: {DATA}, {DOCUMENT}")


if __name__ == "__main__":
    main()
