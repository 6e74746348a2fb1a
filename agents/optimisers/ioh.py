"""Results as folders of IOHprofiler, which IOHanalyzer and iohinspector read, one a method."""

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
"""Stands for the value of a run that found nothing feasible: the format has no word for it."""
ATTRIBUTES = ("evaluations", "raw_y")


def write_ioh(runs: Sequence[Run], path: Path) -> list[Path]:
    """Write a folder for each method into a new one; its paths. ValueError where `path` exists.

    A function is an instance of the suite, numbered by its place there; its runs are those of the
    seeds. raw_y: best feasible values by evaluations. Methods that work on the problem itself are
    left out, since their evaluations say nothing, and so is time.
    """
    if path.exists():
        raise ValueError(f"{path} exists; accepted: a new folder")
    numbers = {name: place for place, name in enumerate(suite(), start=1)}
    found = []
    ordered = sorted(runs, key=lambda one: (one.method, numbers[one.instance], one.seed))
    for method, own in groupby((one for one in ordered if not one.inside), lambda one: one.method):
        folder = path / re.sub(r"[^\w.-]", "_", method)
        for name, group in groupby(own, lambda one: one.instance):
            _write_function(folder, method, numbers[name], name, list(group))
        found.append(folder)
    return found


def _write_function(folder: Path, method: str, number: int, name: str, runs: Sequence[Run]) -> None:
    stem, n = f"f{number}_{name}", suite()[name].n
    data = f"data_{stem}/IOHprofiler_{stem}_DIM{n}.dat"
    told, lines = [], []
    for run in runs:
        rows = _rows(run)
        best = rows[-2] if len(rows) > 1 and rows[-1][1] == rows[-2][1] else rows[-1]
        told.append(
            {
                "instance": 1,
                "evals": max(1, int(run.evaluations[-1])),
                "best": {"evals": best[0], "y": best[1], "x": []},
            }
        )
        lines += [" ".join(ATTRIBUTES), *(f"{at} {value:.10g}" for at, value in rows)]
    content = {
        "version": version("stickslip"),
        "suite": "stickslip",
        "function_id": number,
        "function_name": name,
        "maximization": False,
        "algorithm": {"name": method, "info": "from a table of stickslip"},
        "attributes": list(ATTRIBUTES),
        "scenarios": [{"dimension": n, "path": data, "runs": told}],
    }
    write_whole(folder / data, "\n".join(lines) + "\n")
    write_whole(folder / f"IOHprofiler_{stem}.json", json.dumps(content, indent=1) + "\n")


def _rows(run: Run) -> list[tuple[int, float]]:
    """Evaluations and best values, each evaluation once."""
    last = max(1, int(run.evaluations[-1]))
    rows = {
        max(1, int(at)): float(value)
        for at, value in zip(run.evaluations, run.values, strict=True)
        if np.isfinite(value)
    }
    return list({**rows, last: rows.get(last, rows[max(rows)] if rows else NOTHING)}.items())
