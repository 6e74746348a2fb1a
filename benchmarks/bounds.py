"""Lower bounds of the UGV's cost, and the best known cost, on the named tracks.

    python -m benchmarks.bounds [--tracks NAME ...] [--criteria NAME ...] [--update] [--out FILE]

--update writes benchmarks/results/bounds.json, row by row, and the table into docs/drives.md;
--out writes the rows to that file instead. Rows that are not asked for keep what was measured
before: `--tracks --update` measures none and puts what is there into the page.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.report import (
    RESULTS,
    markdown,
    options,
    provenance,
    put_between,
    read_json,
    where,
    write_json,
)
from stickslip.dynamics.ugv import TRACKS, Track
from stickslip.optim import CRITERIA, PostureProblem, solve
from stickslip.optim.posture.bounds.branch import bound_every_drive

DEFAULT, PAGE = RESULTS / "bounds.json", Path("docs/drives.md")
MARKS = ("<!-- bounds -->", "<!-- end of bounds -->")


def measure(track: str, criterion: str) -> dict[str, Any]:
    """The task of the environment's defaults: 0.1 m a step, 1 rad/m, mu 0.8, legs straight at
    first."""
    straight = (np.pi / 2, np.pi / 2)
    problem = PostureProblem.along(
        Track.named(track), criterion, leg_rate=1.0, start_angles=straight
    )
    known = solve(problem, "dp")
    held = problem.objective(np.full(problem.n, np.pi / 2))
    begun = time.process_time()
    found = bound_every_drive(problem, known.x)
    return {
        "track": track,
        "criterion": criterion,
        "unit": problem.criterion.unit,
        "legs straight": held,
        "best known": known.value,
        "over the grid": known.details["grid_bound"],
        "bound": found.value,
        "gap": found.gap,
        "levels": [vars(level) for level in found.levels],
        "seconds": time.process_time() - begun,
    }


def table(rows: list[dict[str, Any]]) -> str:
    """Bound of each criterion and track, with the best known's gap to it."""
    lines: dict[str, dict[str, str]] = {}
    for row in rows:
        name = row["criterion"] if row["unit"] == "-" else f"{row['criterion']} [{row['unit']}]"
        line = lines.setdefault(name, {"criterion": name} | dict.fromkeys(TRACKS, "-"))
        known = row["best known"]
        distinct = known < 0 or known > 1e-6 * abs(row["legs straight"])
        line[row["track"]] = f"{row['bound']:.4g}" + (f" ({row['gap']:.1%})" if distinct else "")
    return markdown(list(lines.values()))


def main(arguments: list[str]) -> None:
    """Measure, print, write."""
    parser = options("bounds", __doc__)
    parser.add_argument("--tracks", nargs="*", default=list(TRACKS), choices=TRACKS)
    parser.add_argument("--criteria", nargs="*", default=list(CRITERIA), choices=list(CRITERIA))
    parser.add_argument("--update", action="store_true", help="results and table in place")
    parser.set_defaults(out=None)
    asked = parser.parse_args(arguments)
    target = asked.out or (DEFAULT if asked.update else None)
    content = read_json(target or DEFAULT)
    rows = {(row["track"], row["criterion"]): row for row in content.get("rows", [])}
    for criterion in asked.criteria:
        for track in asked.tracks:
            row = measure(track, criterion)
            rows[track, criterion] = row
            print(f"{track}, {criterion}: {row['bound']:.6g} <= {row['best known']:.6g} "
                  f"({row['gap']:.2%}, {row['seconds']:.0f} s)", flush=True)  # fmt: skip
            content = {**provenance(), "rows": _sorted(rows)}
            if target is not None:
                write_json(content, target)
    print(table(content["rows"]))
    if asked.update:
        put_between(PAGE, f"{table(content['rows'])}\n\nMeasured on {where(content)}.", MARKS)


def _sorted(rows: dict[tuple[str, str], dict[str, Any]]) -> list[dict[str, Any]]:
    known = list(CRITERIA), list(TRACKS)
    return [rows[track, name] for name in known[0] for track in known[1] if (track, name) in rows]


if __name__ == "__main__":
    main(sys.argv[1:])
