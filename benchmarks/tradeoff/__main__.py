"""Speed against accuracy: fidelity, integrator, step size, table size and precision.

    python -m benchmarks.tradeoff [--quick] [--update] [--out FILE]
    python -m benchmarks.tradeoff --redraw

Measures the settings of cases.py in the scenes of scenes.py and writes the JSON and the picture of
the fronts beside the documentation. --update also writes what follows from it: the points that
`recommend` and the presets choose from, and the tables of docs/tradeoff.md. --redraw does that from
the JSON as it is, without measuring.
"""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.fronts import front_of, knee_of
from benchmarks.report import options, provenance, put_between, write_json
from benchmarks.tradeoff import module, picture, tables
from benchmarks.tradeoff.measure import measure
from benchmarks.tradeoff.points import COSTS, points_of, short
from stickslip.agents.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Callable

RESULTS = Path("benchmarks/results/tradeoff.json")
DOCUMENT = Path("docs/tradeoff.md")
PICTURE = Path("docs/tradeoff.png")
MODULE = Path("dynamics/biped/measured.py")


def main(arguments: list[str] | None = None) -> None:
    """Measure, print the knees, write the files."""
    parser = options("tradeoff", __doc__, RESULTS)
    parser.add_argument("--quick", action="store_true", help="few settings, to try the way")
    parser.add_argument("--update", action="store_true", help="also measured.py and the tables")
    parser.add_argument("--redraw", action="store_true", help="write all from the JSON there is")
    parser.add_argument("--picture", type=Path, default=PICTURE)
    given = parser.parse_args(arguments)
    if given.redraw:
        content = json.loads(given.out.read_text(encoding="utf-8"))
    else:
        content = _measured(given.quick, given.out)
    report(content, print)
    picture.draw(content, given.picture)
    print(f"Written: {given.out}, {given.picture}")
    if given.update or given.redraw:
        write_whole(MODULE, module.source(content))
        put_between(DOCUMENT, tables.body(content))
        print(f"Written: {MODULE}, {DOCUMENT}")


def _measured(quick: bool, out: Path) -> dict[str, Any]:
    """Measure and write the JSON; what there is so far stands beside it until then."""
    begun = time.perf_counter()
    content = {**provenance(), "quick": quick}
    partial = out.with_suffix(".partial.json")

    def keep(found: dict[str, Any]) -> None:
        write_json(content | found | {"seconds": time.perf_counter() - begun}, partial)

    content |= measure(quick, _say, keep)
    content["seconds"] = time.perf_counter() - begun
    write_json(content, out)
    partial.unlink(missing_ok=True)
    return content


def report(content: dict[str, Any], say: Callable[[str], None]) -> None:
    """Name the knee of every front."""
    for scene in dict.fromkeys(row["scene"] for row in content["rows"]):
        for batch in COSTS:
            points = points_of(content["rows"], scene, batch)
            if front_of(points):
                knee = knee_of(points)
                say(
                    f"{scene}, {batch} environments: knee at {short(knee)}: "
                    f"{knee.error:.1e} rad/s, {knee.cost:.1e} s/s"
                )


def _say(line: str) -> None:
    print(line, flush=True)


if __name__ == "__main__":
    main()
