"""Races of optimisers as a page: how close each method came, how soon, and their pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.optimisers.drawn import IN_WORDS
from stickslip.agents.optimisers.measures import TARGETS, costs, ecdf
from stickslip.agents.optimisers.pictures import CLOSE, UNITS, families
from stickslip.agents.optimisers.words import closeness_table, counted_text, first_table
from stickslip.agents.reports.writing import REPORT, write_page
from stickslip.envs.rendering.html.data import Curve, Line, Page, Panel
from stickslip.optim.suite.catalogue import suite
from stickslip.records.table import Table

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from stickslip.agents.optimisers.results import Run

POINTS = 80
"""Of a curve."""


def write_race(runs: Sequence[Run], folder: Path, drawn: Sequence[Path]) -> Path:
    """Write report.html into a new folder and return its path; drawn: pictures of the runs."""
    single = [run for run in runs if len(suite()[run.instance].goals) == 1]
    methods, instances = ({getattr(run, of) for run in runs} for of in ("method", "instance"))
    closeness = f"Median gap at the end (share of runs within {CLOSE:.0%})"
    tables = [(closeness, closeness_table(runs))]
    if single:
        first = first_table(single)
        rows = [[cell.replace("`", "") for cell in row] for row in first.rows]
        tables.append(("The first methods of each instance", Table(first.columns, rows)))
    page = Page(
        title=f"{len(methods)} methods on {len(instances)} instances",
        lead=counted_text(runs).strip(),
        tables=tuple(tables),
        curves=tuple(_curves([run for run in single if not run.inside])),
        pictures=tuple((one.stem, one.read_bytes()) for one in drawn),
        notes=(f"Targets: {len(TARGETS)} gaps from {TARGETS[0]:g} to {TARGETS[-1]:g}.",),
    )
    return write_page(page, folder / REPORT)


def _curves(runs: Sequence[Run]) -> list[Curve]:
    """Of each family the share of targets hit over evaluations, a line a method, as far as its runs
    go."""
    made = []
    for family in families(runs):
        there = [run for run in runs if suite()[run.instance].family == family]
        by = {
            name: [run for run in there if run.method == name]
            for name in dict.fromkeys(run.method for run in there)
        }
        ends = {name: max(_spent(run) for run in mine) for name, mine in by.items()}
        first = min(1 / suite()[run.instance].n for run in there)
        at = np.geomspace(first, max(2 * first, *ends.values()), POINTS)
        lines = tuple(Line(name, _share(mine, at, ends[name])) for name, mine in by.items())
        panel = Panel(f"targets hit, {IN_WORDS[family]}", "-", lines, steps=True)
        made.append(Curve(UNITS["evaluations"], at, panel, log=True))
    return made


def _spent(run: Run) -> float:
    return float(costs(run, "evaluations")[-1]) / suite()[run.instance].n


def _share(runs: Sequence[Run], at: np.ndarray, end: float) -> np.ndarray:
    rises, share = ecdf(runs, "evaluations")
    found = np.append(0.0, share)[np.searchsorted(rises, at, side="right")]
    return np.where(at <= end * (1 + 1e-9), found, np.nan)
