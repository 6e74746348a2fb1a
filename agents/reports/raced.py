"""Races of optimisers as a page: how close each method came, how soon, and their pictures."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.optimisers.best import MOST_SHOWN, best_of
from stickslip.agents.optimisers.drawn import IN_WORDS
from stickslip.agents.optimisers.measures import TARGETS, costs, ecdf
from stickslip.agents.optimisers.pictures import CLOSE, UNITS, families
from stickslip.agents.optimisers.words import closeness_table, counted_text, first_table
from stickslip.agents.reports.course import sameness
from stickslip.agents.reports.writing import REPORT, write_page, written_or_told
from stickslip.envs.rendering.html.data import Curve, Line, Page, Panel
from stickslip.optim.instances.catalogue import suite
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from stickslip.agents.optimisers.best import Best
    from stickslip.agents.optimisers.results import Run
    from stickslip.envs.rendering.html.data import Shown

POINTS = 80
"""Of a curve."""
CAPTIONS = {
    "ecdf_evaluations": "Targets hit, over evaluations",
    "ecdf_seconds": "Targets hit, over processor time",
    "profiles": "Performance profiles",
    "ert": "Expected running time",
    "feasible": "Runs that found a feasible point",
    "hypervolume": "Two goals: hypervolume that is missing",
}
"""By the ends of their files' names."""
FIGURES = 6
"""Digits of a value."""


def report_race(
    runs: Sequence[Run], folder: Path, say: Callable[[str], None] = lambda stage: None
) -> Path | None:
    """Write report.html into a race's directory, in place of one that is there; return its path.

    Where that fails, there is a warning and no path. say: told of what goes on.
    """
    return written_or_told(folder, lambda: write_race(runs, folder, (), overwrite=True, say=say))


def write_race(
    runs: Sequence[Run],
    folder: Path,
    drawn: Sequence[Path],
    *,
    overwrite: bool = False,
    say: Callable[[str], None] = lambda stage: None,
) -> Path:
    """Write report.html into a folder and return its path; drawn: pictures of the runs. say: told
    of what goes on. ValueError for a page that is there, unless overwrite."""
    played, more = best_of(runs, say)
    single = [run for run in runs if len(suite()[run.instance].goals) == 1]
    methods, instances = ({getattr(run, of) for run in runs} for of in ("method", "instance"))
    closeness = f"Median gap at the end (share of runs within {CLOSE:.0%})"
    tables = [(closeness, closeness_table(runs))]
    if single:
        first = first_table(single)
        rows = [[cell.replace("`", "") for cell in row] for row in first.rows]
        tables.append(("The first methods of each instance", Table(first.columns, rows)))
    if played:
        tables.append(("The best points, evaluated again and shown below", _best_table(played)))
    page = Page(
        title=f"{_counted(len(methods), 'method')} on {_counted(len(instances), 'instance')}",
        lead=counted_text(runs).strip(),
        tables=tuple(tables),
        episodes=tuple(_episode(one) for one in played),
        curves=tuple(_curves([run for run in single if not run.inside])),
        pictures=tuple((_caption(one), one.read_bytes()) for one in drawn),
        over="All runs",
        notes=(
            f"Targets: {len(TARGETS)} gaps from {TARGETS[0]:g} to {TARGETS[-1]:g}.",
            *_notes(runs, played, more),
        ),
    )
    return write_page(page, folder / REPORT, overwrite=overwrite)


def _caption(picture: Path) -> str:
    return next((words for end, words in CAPTIONS.items() if picture.stem.endswith(end)), "")


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def _notes(runs: Sequence[Run], played: Sequence[Best], more: int) -> list[str]:
    """What the episodes are, and why there are none or no more."""
    if not played:
        known = any(run.point is not None for run in runs)
        why = (
            "none of the instances is about a drive or a walk"
            if known
            else ("the runs hold no points (column `point`)")
        )
        return [f"No episode is shown: {why}."]
    words = (
        f"Episodes: the best point of each instance, of at most {MOST_SHOWN} instances. Drives and "
        "gaits are drawn waypoint by waypoint as they were optimised, walks simulated again."
    )
    return [words + (f" {more} more could be shown." if more else "")]


def _best_table(played: Sequence[Best]) -> Table:
    heads = [Column(name, words=True) for name in ("instance", "method")]
    heads += [Column(name) for name in ("seed", "recorded", "again", "best known")]
    heads += [Column("the same", words=True)]
    rows = []
    for one in played:
        run, known = one.run, suite()[one.run.instance].best_known
        row = [run.instance, run.method, run.seed]
        row += [f"{value:.{FIGURES}g}" for value in (run.best, one.again, known)]
        rows.append([*row, _sameness(one)])
    return Table(heads, rows)


def _sameness(one: Best) -> str:
    if not one.feasible:
        return "no: a constraint is missed now"
    return sameness(one.apart, one.same)


def _episode(one: Best) -> Shown:
    goal, unit, _ = re.split(r"\s*[\[\]]", suite()[one.run.instance].goals[0])
    end = "" if unit == "-" else f" {unit}"
    more = [
        (goal.replace("_", " "), f"{one.run.best:.{FIGURES}g}{end}"),
        ("seed", str(one.run.seed)),
    ]
    if not one.same:
        more.append(("evaluated again", f"{one.again:.{FIGURES}g}{end}, {_sameness(one)}"))
    return replace(one.shown, facts=(*more, *one.shown.facts))


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
