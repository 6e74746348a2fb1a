"""Rank methods over the named tasks: scores, aggregates with intervals, a picture.

Aggregates are those of Agarwal et al., "Deep Reinforcement Learning at the Edge of the Statistical
Precipice" (NeurIPS 2021), with percentile bootstrap intervals over the runs of each task.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from stickslip.agents.evaluation.results import Method, Result
from stickslip.agents.evaluation.table import mean_interval
from stickslip.agents.machine import machine_by_name
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.sheet import make_sheet, name_panel, save_sheet, styled
from stickslip.envs.tasks.definition import TASKS
from stickslip.envs.tasks.known import CONFIDENCE, OVER, RESAMPLES, UNKNOWN, Interval
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from jaxtyping import Float

    Scores: TypeAlias = Float[np.ndarray, "... runs tasks"]
    Statistic: TypeAlias = Callable[[Scores], np.ndarray]

THRESHOLDS = np.linspace(0.0, 1.0, 101)
"""Scores of a performance profile."""
COSTS = {"steps": "steps", "time [s]": "seconds", "processor time [s]": "processor_seconds"}
"""Columns of what a training took, and a result's entries of them."""
DASHES = ("-", "--", ":")
"""Lines of the methods past the number of colours."""


def _flat(scores: Scores) -> np.ndarray:
    return scores.reshape(*scores.shape[:-2], -1)


def iqm(scores: Scores) -> np.ndarray:
    """Interquartile mean: of the middle half of all runs on all tasks."""
    from scipy.stats import trim_mean

    return np.asarray(trim_mean(_flat(scores), 0.25, axis=-1))


def mean(scores: Scores) -> np.ndarray:
    """Mean of all runs on all tasks."""
    return _flat(scores).mean(-1)


def optimality_gap(scores: Scores) -> np.ndarray:
    """Mean of what runs lack of a score of 1; what they have beyond it makes up for nothing."""
    return _flat(np.maximum(1.0 - scores, 0.0)).mean(-1)


def profile(scores: Scores) -> np.ndarray:
    """Share of the runs with a score above each of THRESHOLDS."""
    return (_flat(scores)[..., None] > THRESHOLDS).mean(-2)


AGGREGATES: Mapping[str, Statistic] = {"IQM": iqm, "mean": mean, "optimality gap": optimality_gap}


def aggregate(statistic: Statistic, scores: Scores) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A statistic of scores [runs, tasks] and both ends of its interval, NaN for a single run.

    Each task's runs are drawn anew by themselves (stratified bootstrap). Deterministic.
    """
    value = statistic(scores)
    runs, tasks = scores.shape
    if runs < 2:
        return value, np.full_like(value, UNKNOWN), np.full_like(value, UNKNOWN)
    drawn = np.random.default_rng(0).integers(runs, size=(RESAMPLES, runs, tasks))
    resampled = statistic(np.take_along_axis(scores[None], drawn, axis=1))
    low, high = np.quantile(resampled, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2], axis=0)
    return value, low, high


@dataclass(frozen=True)
class Comparison:
    """The methods of one machine on the tasks of which all of them have results.

    scores: by method, [runs, tasks]: of each task the first `runs`, as many as the least has.
    """

    machine: str
    tasks: tuple[str, ...]
    scores: Mapping[str, np.ndarray]

    @cached_property
    def aggregates(self) -> dict[str, dict[str, Interval]]:
        """AGGREGATES of each method, the best interquartile mean first."""
        best = sorted(self.scores, key=lambda name: -float(iqm(self.scores[name])))
        return {
            name: {
                what: Interval(*map(float, aggregate(statistic, self.scores[name])))
                for what, statistic in AGGREGATES.items()
            }
            for name in best
        }


def comparisons(methods: Sequence[Method], least: Collection[str] = ()) -> list[Comparison]:
    """A comparison for each machine with a task that all its methods have.

    least: tasks without which a method is left out, those of its machine.
    """
    found, every = [], {one.name: one.by_task() for one in methods}
    for machine, group in groupby(TASKS, lambda name: TASKS[name].machine):
        own = list(group)
        needed = {name for name in own if name in least}
        suited = (one for one, of in every.items() if of.keys() & set(own) and needed <= of.keys())
        there = {name: every[name] for name in suited}
        common = [task for task in own if there and all(task in one for one in there.values())]
        if common:
            scores = {name: _matrix([its[task] for task in common]) for name, its in there.items()}
            found.append(Comparison(machine, tuple(common), scores))
    return found


def _matrix(runs: Sequence[Sequence[Result]]) -> np.ndarray:
    least = min(map(len, runs))
    scores = np.array([[one.score.value for one in its[:least]] for its in runs]).T
    return np.nan_to_num(scores, nan=0.0)  # over the cost limit: as good as doing nothing


def score_table(methods: Sequence[Method]) -> Table:
    """Every method's score on each task, with the steps and time of its training."""
    words = [Column(name, words=True) for name in ("task", "method")]
    heads = [Column(name) for name in ("runs", "score", "return", "failures", *COSTS)]
    there = {one.name: one.by_task() for one in methods}
    pairs = [(task, name) for task in TASKS for name in there if task in there[name]]
    rows = [[task, name, *_cells(there[name][task])] for task, name in pairs]
    return _filled([*words, *heads, Column("replayed")], rows)


def score_of(runs: Sequence[Result]) -> str:
    """Mean score; ± is half of a 95 % interval: over the runs, or over the episodes of one."""
    scores = [one.score for one in runs]
    if over := sum(np.isnan(one.value) for one in scores):
        return OVER if len(runs) == 1 else f"{over} of {len(runs)} {OVER}"
    return (scores[0] if len(runs) == 1 else mean_interval([s.value for s in scores])).shown(2)


def _cells(runs: Sequence[Result]) -> list[object]:
    earned = [float(np.mean(one.returns)) for one in runs]
    failures = _average([one.failures for one in runs], ".0%")
    replayed = f"{sum(one.replayed for one in runs)} of {len(runs)}"
    shown = len(runs), score_of(runs), _average(earned, ".4g"), failures
    return [*shown, *_costs(runs), replayed]


def _costs(runs: Sequence[Result]) -> list[str]:
    """COSTS in the mean of the runs of which they are known."""
    return [_average([getattr(one, name) for one in runs], ",.0f") for name in COSTS.values()]


def _average(values: Sequence[float | None], form: str) -> str:
    there = [one for one in values if one is not None]
    return format(float(np.mean(there)), form) if there else ""


def _filled(columns: Sequence[Column], rows: Sequence[Sequence[object]]) -> Table:
    """A table without empty columns."""
    used = [i for i in range(len(columns)) if any(row[i] != "" for row in rows)]
    return Table([columns[i] for i in used], [[row[i] for i in used] for row in rows])


def aggregate_table(methods: Sequence[Method], found: Sequence[Comparison]) -> Table:
    """Aggregates of every method for each machine, and what its training took in the mean."""
    words = [Column(name, words=True) for name in ("machine", "method")]
    heads = [Column(name) for name in ("tasks", "runs of each", *AGGREGATES, *COSTS)]
    there = {one.name: one.by_task() for one in methods}
    rows = []
    for one in found:
        for name, its in one.aggregates.items():
            counts = (len(one.tasks), len(one.scores[name]))
            taken = _costs([run for task in one.tasks for run in there[name][task]])
            title = machine_by_name(one.machine).title
            rows.append([title, name, *counts, *(v.shown(2) for v in its.values()), *taken])
    return _filled([*words, *heads], rows)


def common_tasks(found: Sequence[Comparison]) -> str:
    """The tasks of the aggregates."""
    if not found:
        return "No aggregates: the methods have no task in common."
    parts = (f"{machine_by_name(one.machine).title}, {', '.join(one.tasks)}" for one in found)
    return f"Aggregates are over the tasks that all methods have: {'; '.join(parts)}."


@styled
def draw_profiles(found: Sequence[Comparison], path: Path) -> Path:
    """Write performance profiles: the share of runs above each score, with 95 % bands."""
    figure, axes = make_sheet(1, len(found), (5.0 * len(found), 4.0), sharex=False)
    names = list(dict.fromkeys(name for one in found for name in one.scores))
    lines = {}
    for axis, one in zip(axes, found, strict=True):
        for name, scores in one.scores.items():
            dashes, colour = divmod(names.index(name), len(theme.PLAYERS))
            style: Any = {"color": theme.PLAYERS[colour], "ls": DASHES[dashes % len(DASHES)]}
            value, low, high = aggregate(profile, scores)
            (lines[name],) = axis.plot(THRESHOLDS, value, **style)
            axis.fill_between(THRESHOLDS, low, high, color=style["color"], alpha=0.18, lw=0)
        label = f"share of runs, {machine_by_name(one.machine).title}"
        name_panel(axis, label, f"tasks: {len(one.tasks)}", "with a score above")
    figure.legend([lines[name] for name in names], names, loc="outside lower center", ncols=4)
    return save_sheet(figure, path)
