"""Errors and costs of settings, which `recommend` and the presets promise.

    python -m benchmarks.tradeoff [--quick] [--update] [--only PART ...] [--out FILE]
    python -m benchmarks.tradeoff --redraw

population: each setting's errors on hundreds of seeded walks. costs: processor time of a simulated
second. Only the parts named are measured; the JSON keeps the other, with its commit. --update also
writes the module that `recommend` reads, the tables of docs/tradeoff.md and the picture; --redraw
does that without measuring.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.report import measured_parts, options, put_between, read_json
from benchmarks.tradeoff import recommended
from benchmarks.tradeoff.costs import costs
from benchmarks.tradeoff.promises import population, samples
from stickslip.records.files import write_whole

RESULTS = Path("benchmarks/results/tradeoff.json")
DOCUMENT = Path("docs/tradeoff.md")
PICTURE = Path("docs/tradeoff.png")
DATA = Path("dynamics/biped/measured.json")
PARTS: dict[str, Any] = {"samples": samples, "population": population, "costs": costs}


def main(arguments: list[str] | None = None) -> None:
    """Measure, print, write the files."""
    parser = options("tradeoff", __doc__, RESULTS)
    parser.add_argument("--quick", action="store_true", help="a few of each")
    parser.add_argument("--update", action="store_true", help="also data, tables and picture")
    parser.add_argument("--redraw", action="store_true", help="write all from the JSON there is")
    parser.add_argument("--only", nargs="+", choices=list(PARTS), default=list(PARTS))
    given = parser.parse_args(arguments)
    content = read_json(given.out)
    if not given.redraw:
        asked = {name: PARTS[name] for name in given.only}
        content = measured_parts(asked, list(PARTS), given.quick, given.out)
    if given.update or given.redraw:
        recommended.draw(content, PICTURE)
        write_whole(DATA, recommended.source(content))
        put_between(DOCUMENT, recommended.body(content))
        print(f"Written: {PICTURE}, {DATA}, {DOCUMENT}")


if __name__ == "__main__":
    main()
