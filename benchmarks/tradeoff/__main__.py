"""Speed against accuracy: fidelity, integrator, step size, table size and precision.

    python -m benchmarks.tradeoff [--quick] [--update] [--only PART ...] [--missing] [--out FILE]
    python -m benchmarks.tradeoff --redraw

population: what each setting's error comes to on hundreds of seeded walks (population.py), of which
`recommend` and the presets make their promises. walks: what the settings of cases.py cost, and
events, forces and energy, on the five single walks of scenes.py. The JSON keeps the part that is
not measured; --missing measures of the walks only what it lacks. --update also writes what follows:
the module that `recommend` reads, the tables of docs/tradeoff.md and the picture; --redraw does it
without measuring.
"""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.fronts import front_of, knee_of
from benchmarks.report import kept_parts, options, provenance, put_between, read_json, write_json
from benchmarks.tradeoff import measure, module, picture, promises, tables
from benchmarks.tradeoff.points import COSTS, promises_of, short
from benchmarks.tradeoff.population import FLOORS, ROBOTS
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Callable

RESULTS = Path("benchmarks/results/tradeoff.json")
DOCUMENT = Path("docs/tradeoff.md")
PICTURE = Path("docs/tradeoff.png")
MODULE = Path("dynamics/biped/trade/measured.py")
PARTS = ("population", "walks")


def main(arguments: list[str] | None = None) -> None:
    """Measure, print the knees, write the files."""
    parser = options("tradeoff", __doc__, RESULTS)
    parser.add_argument("--quick", action="store_true", help="few settings, to try the way")
    parser.add_argument("--update", action="store_true", help="also module, tables and picture")
    parser.add_argument("--redraw", action="store_true", help="write all from the JSON there is")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--missing", action="store_true", help="of walks, what the JSON lacks")
    parser.add_argument("--picture", type=Path, default=PICTURE)
    given = parser.parse_args(arguments)
    if given.redraw:
        content = json.loads(given.out.read_text(encoding="utf-8"))
    else:
        content = _measured(given.only, given.quick, given.missing, given.out)
        print(f"Written: {given.out}")
    if not all(part in content for part in PARTS):
        return
    report(content, print)
    if given.update or given.redraw:
        picture.draw(content, given.picture)
        write_whole(MODULE, module.source(content))
        put_between(DOCUMENT, tables.body(content))
        print(f"Written: {given.picture}, {MODULE}, {DOCUMENT}")


def _measured(names: list[str], quick: bool, missing: bool, out: Path) -> dict[str, Any]:
    """Measure the parts, writing the JSON after each; what there is so far stands beside it."""
    content = kept_parts(out, PARTS)
    partial = out.with_suffix(".partial.json")
    for name in names:
        begun, used = time.perf_counter(), time.process_time()

        def keep(found: dict[str, Any], name: str = name) -> None:
            write_json(content | {name: found}, partial)

        earlier = {}
        if name == "walks":
            had = read_json(out).get(name) if missing else None
            content[name] = measure.measure(quick, _say, keep, had)
            earlier = {"completes": content["parts"][name]} if had else {}
        else:
            content[name] = promises.population(quick, _say, keep)
        content["parts"][name] = earlier | {
            "commit": content["commit"],
            "measured": provenance()["measured"],
            "quick": quick,
            "seconds": time.perf_counter() - begun,
            "processor_seconds": time.process_time() - used,
        }
        write_json(content, out)
    partial.unlink(missing_ok=True)
    return content


def report(content: dict[str, Any], say: Callable[[str], None]) -> None:
    """Name the knee of every front."""
    for floor in FLOORS:
        for batch in COSTS:
            points = promises_of(content, floor, ROBOTS[0], batch)
            if front_of(points):
                knee = knee_of(points)
                say(
                    f"{floor}, {batch} environments: knee at {short(knee)}: 95 % of the walks "
                    f"within {knee.error:.1e} rad/s, {knee.cost:.1e} s/s"
                )


def _say(line: str) -> None:
    print(line, flush=True)


if __name__ == "__main__":
    main()
