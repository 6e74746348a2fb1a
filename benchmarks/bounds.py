"""Lower bounds of the UGV's cost, and the best known cost, on the named tracks.

    python -m benchmarks.bounds [--quick] [--update] [--out FILE]
    python -m benchmarks.bounds --redraw

--update also writes the table of docs/drives.md; --redraw does that without measuring.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.report import markdown, measured_by_command, put_between, where
from stickslip.dynamics.ugv import TRACKS, Track
from stickslip.optim import CRITERIA, PostureProblem, solve
from stickslip.optim.posture.bounds.branch import bound_every_drive

PAGE = Path("docs/drives.md")


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
        "levels": found.levels,
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


def rows(quick: bool) -> Iterator[dict[str, Any]]:
    """A row for each criterion and track."""
    for criterion in list(CRITERIA)[:1] if quick else CRITERIA:
        for track in TRACKS[:2] if quick else TRACKS:
            yield measure(track, criterion)


def update(content: dict[str, Any]) -> None:
    """Write the page's table."""
    put_between(PAGE, f"{table(content['rows'])}\n\nMeasured on {where(content)}.", "bounds")


if __name__ == "__main__":
    measured_by_command("bounds", __doc__, {"rows": rows}, update)
