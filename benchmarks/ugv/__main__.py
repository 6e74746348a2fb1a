"""The UGV measured: poses a second, dynamic programming, every method, speed against accuracy.

    python -m benchmarks.ugv [--quick] [--update] [--only PART ...] [--out FILE]
    python -m benchmarks.ugv --redraw

throughput: poses and equilibria a second beside a plain loop and NumPy. growth: the time of dp with
the grid and the track's length. methods: all methods on twelve tracks. trade: error against time
for solvers, tables and precisions. promise: errors and statuses of settings over random vehicles,
ground and postures. Only the parts named are measured; the JSON
keeps the others, each with its commit. --update also writes the picture, what `recommend` chooses
from, and the tables of docs/ugv_tradeoff.md; --redraw does that without measuring.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.report import kept_parts, options, provenance, put_between, write_json
from benchmarks.ugv import module, picture, tables
from benchmarks.ugv.growth import grids, growth
from benchmarks.ugv.methods import methods
from benchmarks.ugv.promise import promises
from benchmarks.ugv.throughput import throughput
from benchmarks.ugv.trade import trade
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Callable

RESULTS = Path("benchmarks/results/ugv.json")
DOCUMENT = Path("docs/ugv_tradeoff.md")
PICTURE = Path("docs/ugv_tradeoff.png")
MODULE = Path("dynamics/ugv/trade/measured.py")

PARTS: dict[str, Callable[[bool], Iterator[dict[str, Any]]]] = {
    "throughput": throughput,
    "growth": growth,
    "grids": grids,
    "methods": methods,
    "trade": trade,
    "promise": promises,
}
NAMES = {"throughput": ("throughput",), "dp": ("growth", "grids"), "methods": ("methods",),
         "trade": ("trade",), "promise": ("promise",)}  # fmt: skip
"""What may be asked for, and the tables of the JSON that it fills."""


def main(arguments: list[str] | None = None) -> None:
    """Measure, print, write the files."""
    parser = options("ugv", __doc__, RESULTS)
    parser.add_argument("--quick", action="store_true", help="a few of each, to try the way")
    parser.add_argument("--update", action="store_true", help="also picture, module and tables")
    parser.add_argument("--redraw", action="store_true", help="write all from the JSON there is")
    parser.add_argument("--only", nargs="+", choices=list(NAMES), default=list(NAMES))
    given = parser.parse_args(arguments)
    if given.redraw:
        content = json.loads(given.out.read_text(encoding="utf-8"))
    else:
        content = measured(given.only, given.quick, given.out)
        print(f"Written: {given.out}")
    if given.update or given.redraw:
        picture.draw(content, PICTURE)
        write_whole(MODULE, module.source(content))
        put_between(DOCUMENT, tables.body(content))
        print(f"Written: {PICTURE}, {MODULE}, {DOCUMENT}")


def measured(names: list[str], quick: bool, out: Path) -> dict[str, Any]:
    """Measure the parts, writing the JSON after each; its other parts stay."""
    content = kept_parts(out, PARTS)
    for name in names:
        for part in NAMES[name]:
            begun, used = time.perf_counter(), time.process_time()
            rows = []
            for row in PARTS[part](quick):
                rows.append(row)
                shown = ", ".join(map(_shown, list(row.values())[:9]))
                print(f"{part} {len(rows)} [{time.perf_counter() - begun:.0f} s]: {shown}",
                      flush=True)  # fmt: skip
            content[part] = rows
            content["parts"][part] = {
                "commit": content["commit"],
                "measured": provenance()["measured"],
                "quick": quick,
                "seconds": time.perf_counter() - begun,
                "processor_seconds": time.process_time() - used,
            }
            write_json(content, out)
    return content


def _shown(value: Any) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    main()
