"""A race of the methods on some of the suite, kept as Parquet, and what is drawn from it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pyarrow import parquet

from benchmarks.report import RESULTS, provenance, put_between, where
from stickslip.agents.optimisers import METHODS, race, read_results
from stickslip.agents.optimisers.directory import missing_runs
from stickslip.agents.optimisers.pictures import draw_report
from stickslip.agents.optimisers.plan import RacePlan
from stickslip.agents.optimisers.results import table_of
from stickslip.agents.optimisers.words import methods_table, report_text
from stickslip.agents.sweeps.files.parquet import ABOUT, write_chunk
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
        report=False,
    )
    store(folder)


def store(folder: Path) -> None:
    """Keep the runs of a folder, those of instances that are whole, with where they were made."""
    plan = RacePlan.of(
        METHODS, INSTANCES, budget=BUDGET, seconds=SECONDS, seeds=SEEDS, outside="clip", limit=LIMIT
    )
    halves = {plan.tasks[index].instance for index in missing_runs(folder, plan)}
    runs = [run for run in read_results(folder) if run.instance not in halves]
    about = {
        **provenance(),
        "budget": BUDGET,
        "seconds": SECONDS,
        "seeds": SEEDS,
        "race": json.loads((folder / "race.json").read_text("utf-8"))["versions"],
    }
    write_chunk(STORED, table_of(runs, about))
    print(f"{STORED}: {len(runs)} runs, {STORED.stat().st_size} bytes")


def stored_about() -> dict[str, Any]:
    """What the kept file says of itself."""
    return json.loads((parquet.read_schema(STORED).metadata or {})[ABOUT])


def redraw() -> None:
    """The page's tables and pictures from what is kept."""
    runs, about = read_results(STORED), stored_about()
    order = {name: place for place, name in enumerate(METHODS)}
    places = {name: place for place, name in enumerate(suite())}
    runs = sorted(runs, key=lambda one: (order[one.method], places[one.instance], one.seed))
    words = (
        f"{about['budget']} values and gradients or {about['seconds']:g} s of processor time, "
        f"seeds 0 to {about['seeds'] - 1}; {where(about)}.\n\n{report_text(runs)}"
    )
    put_between(PAGE, f"\n{methods_table().markdown(aligned=True)}", METHODS_MARKS)
    put_between(PAGE, f"\n{words}", RACE_MARKS)
    for path in draw_report(runs, PAGE.parent, STEM):
        print(f"Written: {path}")
