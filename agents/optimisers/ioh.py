"""Results as folders of IOHprofiler, one for each method, for IOHanalyzer and iohinspector."""

from __future__ import annotations

import json
import re
from importlib.metadata import version
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.instances.catalogue import suite
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from stickslip.agents.optimisers.results import Run

NOTHING = 1e300
"""Value of a run that found nothing feasible: the format has no word for it."""
ATTRIBUTES = ["evaluations", "raw_y"]


def write_ioh(runs: Sequence[Run], path: Path) -> list[Path]:
    """Write a folder for each method into a new one; their paths. ValueError where `path` exists.

    A function is an instance, numbered by its place in the suite; its runs are those of the seeds.
    Methods that work on the problem itself, whose evaluations say nothing, are left out.
    """
    if path.exists():
        raise ValueError(f"{path} exists; accepted: a new folder")
    numbers = {name: place for place, name in enumerate(suite(), start=1)}
    ordered = sorted(runs, key=lambda one: (one.method, numbers[one.instance], one.seed))
    ordered = [one for one in ordered if not one.inside]
    found: list[Path] = []
    for (method, name), group in groupby(ordered, lambda one: (one.method, one.instance)):
        folder = path / re.sub(r"[^\w.-]", "_", method)
        found += [] if folder in found else [folder]
        stem, n = f"f{numbers[name]}_{name}", suite()[name].n
        data = f"data_{stem}/IOHprofiler_{stem}_DIM{n}.dat"
        ends, lines = [], list[str]()
        for run in group:
            rows = _rows(run)
            best = next(row for row in rows if row[1] == rows[-1][1])
            last = {"evals": best[0], "y": best[1], "x": []}
            ends.append({"instance": 1, "evals": rows[-1][0], "best": last})
            lines += [" ".join(ATTRIBUTES), *(f"{at} {value:.10g}" for at, value in rows)]
        content = {
            "version": version("stickslip"),
            "suite": "stickslip",
            "function_id": numbers[name],
            "function_name": name,
            "maximization": False,
            "algorithm": {"name": method, "info": "from a table of stickslip"},
            "attributes": ATTRIBUTES,
            "scenarios": [{"dimension": n, "path": data, "runs": ends}],
        }
        write_whole(folder / data, "\n".join(lines) + "\n")
        write_whole(folder / f"IOHprofiler_{stem}.json", json.dumps(content, indent=1) + "\n")
    return found


def _rows(run: Run) -> list[tuple[int, float]]:
    """Evaluations and best values, each evaluation once."""
    pairs = zip(run.evaluations, run.values, strict=True)
    rows = {max(1, int(at)): float(value) for at, value in pairs if np.isfinite(value)}
    last = max(1, int(run.evaluations[-1]))
    return list({**rows, last: rows.get(last, rows[max(rows)] if rows else NOTHING)}.items())
