"""Every method on twelve tracks: value, gap, evaluations, time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.ugv.growth import FIRST, LAST, MIDDLING, RATE, WAYPOINTS, finer_value
from benchmarks.ugv.tracks import twelve
from stickslip.dynamics.ugv import UGVParams
from stickslip.optim import PostureProblem, PostureResult, solve

CRITERIA = ("wheel_energy", "peak_torque")
ANGLES = MIDDLING
"""Of each leg."""
RUNS: dict[str, tuple[str, dict[str, Any]]] = {
    "grid": ("grid", {"angles": ANGLES}),
    "grid, within rate": ("grid", {"angles": ANGLES, "within_rate": True}),
    "dp": ("dp", {"angles": ANGLES}),
    "scp": ("scp", {"angles": ANGLES}),
    "gradient": ("gradient", {"angles": ANGLES, "iterations": 100}),
    "cma": ("cma", {"angles": ANGLES, "evaluations": 500}),
}
"""Name shown, method and its options. The last three begin at dp's path. lp is not among them: its
graph has half a million edges at this spacing."""
SMALL = 1.0
"""Gaps are in parts of at least this [J], [N m]."""
TOLERANCE = 1e-4
"""Gap up to which a method counts as reaching the best known value."""


def methods(quick: bool) -> Iterator[dict[str, Any]]:
    """A row for each criterion, track and method; the tracks share their compiled programs."""
    listed = twelve()[:2] if quick else twelve()
    x = np.linspace(FIRST, LAST, WAYPOINTS)
    for criterion in CRITERIA:
        for index, one in enumerate(listed):
            problem = PostureProblem(UGVParams(), one.track(), x, criterion, leg_rate=RATE)
            straight = problem.objective(np.full(problem.n, np.pi / 2))
            rows = []
            for name, (method, options) in RUNS.items():
                if quick and name in ("gradient", "cma"):
                    continue
                if index == 0:  # compiles
                    solve(problem, method, polish=False, **options)
                found = solve(problem, method, polish=False, **options)
                rows.append({"criterion": criterion, "track": one.name, "method": name,
                             "straight": straight, "finer": finer_value(problem, found)}
                            | _row(found))  # fmt: skip
            yield from with_gaps(rows)


def _row(found: PostureResult) -> dict[str, Any]:
    return {
        "value": found.value if np.isfinite(found.value) else None,
        "feasible": found.feasible,
        "status": found.status.name,
        "bound": found.details.get("grid_bound"),
        "evaluations": found.evaluations,
        "seconds": found.seconds,
        "missed": {name: by for name, by in found.residuals.items() if by > 0},
        "message": found.message,
    }


def with_gaps(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows of one problem with their distance from the best feasible value known and from dp's,
    which is the least of all paths over its grid; None for what is not feasible.

    In parts of the value with the legs straight down: the best value itself may be zero.
    """
    known = [row["value"] for row in rows if row["feasible"]]
    proved = [row["bound"] for row in rows if row["method"] == "dp" and row["bound"] is not None]
    for row in rows:
        for name, reference in (("gap", known), ("over_dp", proved)):
            good = row["feasible"] and reference
            row[name] = (
                (row["value"] - min(reference)) / max(row["straight"], SMALL) if good else None
            )
    return rows
