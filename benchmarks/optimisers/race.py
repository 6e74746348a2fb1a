"""A race of the methods on some of the suite, kept as Parquet, and what is drawn from it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pyarrow import parquet

from benchmarks.report import RESULTS, provenance, put_between, where
from stickslip.agents.optimisers import METHODS, race, read_results, write_results
from stickslip.agents.optimisers.method import methods_table
from stickslip.agents.optimisers.racing import RacePlan
from stickslip.agents.optimisers.report import draw_ecdfs, report_text
from stickslip.agents.sweeps.store import KEY, read_head
from stickslip.optim import suite

INSTANCES = (
    "shoot-grip-d10-v1",
    "ugv-bump-energy-d16-v2",
    "shoot-slippery-d20-v1",
    "shoot-icy-d20-v1",
    "gait-time-d16-v2",
    "ugv-bump-energy-d64-v2",
    "split-bump-squared-torque-d32-v1",
    "goals-ugv-bump-energy-demand-d32-v2",
    "design-biped-friction-d12-v2",
    "goals-gait-time-energy-d32-v2",
    "gains-rate3-d4-v1",
)
BUDGET, SECONDS, SEEDS, LIMIT = 1000, 2.0, 3, 300.0
"""Values and gradients; processor time [s]; seeds; time on the clock until a run is killed."""
STORED = RESULTS / "optimisers.parquet"
PAGE, STEM = Path("docs/optimisers.md"), "optimisers"
METHODS_MARKS = ("<!-- methods -->", "<!-- end of methods -->")
RACE_MARKS = ("<!-- race -->", "<!-- end of race -->")


def run(folder: Path, workers: int | None) -> None:
    """Race into a folder, or go on there; then keep all of it."""
    race(
        METHODS,
        INSTANCES,
        budget=BUDGET,
        seconds=SECONDS,
        seeds=SEEDS,
        limit=LIMIT,
        out=folder,
        resume=folder.exists(),
        workers=workers,
        progress=True,
    )
    store(folder)


def store(folder: Path) -> None:
    """Keep the runs of a folder, those of instances that are whole, with where they were made."""
    how = {"budget": BUDGET, "seconds": SECONDS, "seeds": SEEDS, "limit": LIMIT}
    plan = RacePlan.of(METHODS, INSTANCES, **how)
    halves = {plan.tasks[number].instance for number in plan.missing(folder)}
    runs = [run for run in read_results(folder) if run.instance not in halves]
    about = {
        **provenance(),
        "budget": BUDGET,
        "seconds": SECONDS,
        "seeds": SEEDS,
        "race": read_head(folder, "race")["versions"],
    }
    STORED.unlink(missing_ok=True)
    write_results(runs, STORED, about)
    print(f"{STORED}: {len(runs)} runs, {STORED.stat().st_size} bytes")


def stored_about() -> dict[str, Any]:
    """What the kept file says of itself."""
    return json.loads((parquet.read_schema(STORED).metadata or {})[KEY])


def redraw() -> None:
    """The page's tables and pictures from what is kept."""
    runs, about = read_results(STORED), stored_about()
    order, places = list(METHODS), list(suite())
    runs = sorted(
        (run for run in runs if run.method in METHODS),
        key=lambda one: (order.index(one.method), places.index(one.instance), one.seed),
    )
    words = (
        f"{about['budget']} values and gradients or {about['seconds']:g} s of processor time, "
        f"seeds 0 to {about['seeds'] - 1}; {where(about)}.\n\n{report_text(runs)}"
    )
    put_between(PAGE, f"\n{methods_table().markdown(aligned=True)}", METHODS_MARKS)
    put_between(PAGE, f"\n{words}", RACE_MARKS)
    for path in draw_ecdfs(runs, PAGE.parent, STEM):
        print(f"Written: {path}")
