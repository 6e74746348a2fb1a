"""Results in words: what was run, how close each method came, who was first."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.optimisers.drawn import IN_WORDS
from stickslip.agents.optimisers.measures import Cost, Expected, ert, gaps
from stickslip.agents.optimisers.method import METHODS
from stickslip.agents.optimisers.names import FAILED, OUTCOMES
from stickslip.agents.optimisers.pictures import CLOSE, families
from stickslip.optim.instances.catalogue import suite
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.agents.optimisers.results import Run

FIRST = 3
"""Methods that are named for an instance."""
WRONG = 10
"""Runs that failed and are named."""


def report_text(runs: Sequence[Run]) -> str:
    """All of it, in Markdown."""
    heading = f"Median gap at the end (share of runs within {CLOSE:.0%}):\n"
    parts = [counted_text(runs), heading, closeness_table(runs).markdown(aligned=True)]
    single = [run for run in runs if len(suite()[run.instance].goals) == 1]
    if single:
        heading = f"The first {FIRST} methods (interval, runs that hit it / runs):\n"
        parts += [heading, first_table(single).markdown(aligned=True)]
    return "\n".join(parts)


def counted_text(runs: Sequence[Run]) -> str:
    """How many runs of what, what they came to, and which failed."""
    outcomes = Counter(run.outcome for run in runs)
    words = ", ".join(f"{outcomes[one]} {one}" for one in OUTCOMES if outcomes[one])
    seconds = sum(float(np.nan_to_num(run.seconds[-1])) for run in runs)
    spent = sum(int(run.evaluations[-1]) for run in runs)
    instances, methods = ({getattr(run, of) for run in runs} for of in ("instance", "method"))
    found = (
        f"{len(runs)} runs of {len(methods)} methods on {len(instances)} instances: {words}; "
        f"{spent:,} evaluations, {seconds:,.0f} s of processor time.\n"
    )
    moved = sum(run.counts["clipped"] + run.counts["refused"] for run in runs)
    if moved:
        found += f"{moved:,} points lay out of bounds and were moved in or refused.\n"
    failed = [run for run in runs if run.outcome in FAILED]
    for run in failed[:WRONG]:
        found += (
            f"- {run.method} on {run.instance}, seed {run.seed}: {run.outcome}, {run.message}\n"
        )
    return found + (f"- and {len(failed) - WRONG} more\n" if len(failed) > WRONG else "")


def runs_table(runs: Sequence[Run]) -> Table:
    """A row a run: where it ended. gap: to the best known value, as in `gaps`."""
    columns = [Column(name, words=True) for name in ("instance", "method", "seed", "outcome")]
    columns += [Column("evaluations"), Column("seconds", "s"), Column("best"), Column("gap")]
    rows = [
        [*run.key, run.outcome, run.evaluations[-1], run.seconds[-1], run.best, gaps(run)[-1]]
        for run in runs
    ]
    return Table(columns, rows)


def closeness_table(runs: Sequence[Run]) -> Table:
    """Median gap at the end and the share of runs within CLOSE, by method and family."""
    names = families(runs)
    columns = [
        Column("method", words=True),
        *(Column(IN_WORDS[name], words=True) for name in names),
    ]
    rows = []
    for method in dict.fromkeys(run.method for run in runs):
        row = [method]
        for name in names:
            ends = np.array([
                gaps(run)[-1]
                for run in runs
                if run.method == method and suite()[run.instance].family == name
            ])  # fmt: skip
            row.append(_closeness(ends))
        rows.append(row)
    return Table(columns, rows)


def _closeness(ends: np.ndarray) -> str:
    if not len(ends):
        return ""
    ends = np.sort(ends)
    median = (
        ends[(len(ends) - 1) // 2]
        if len(ends) % 2
        else (ends[len(ends) // 2 - 1] + ends[len(ends) // 2]) / 2
    )
    words = "none feasible" if not np.isfinite(ends[0]) else f"{max(median, 0):.2g}"
    if np.isfinite(ends[0]) and not np.isfinite(median):
        words = f"{np.mean(np.isfinite(ends)):.0%} feasible"
    return f"{words} ({np.mean(ends <= CLOSE):.0%})"


def first_table(runs: Sequence[Run]) -> Table:
    """For every instance the methods that come within CLOSE soonest, by evaluations and by time."""
    rows = []
    for name in dict.fromkeys(run.instance for run in runs):
        there = [run for run in runs if run.instance == name]
        rows.append([
            f"`{name}`",
            _first([run for run in there if not run.inside], "evaluations"),
            _first([run for run in there if np.all(np.isfinite(run.seconds))], "seconds"),
        ])  # fmt: skip
    heads = (
        "instance",
        "expected evaluations to 1 %, with interval",
        "expected processor time [s]",
    )
    return Table([Column(head, words=True) for head in heads], rows)


def _first(runs: Sequence[Run], cost: Cost) -> str:
    found: dict[str, Expected] = {}
    for method in dict.fromkeys(run.method for run in runs):
        one = ert([run for run in runs if run.method == method], CLOSE, cost)
        if np.isfinite(one.value):
            found[method] = one
    best = sorted(found, key=lambda method: found[method].value)[:FIRST]
    return "; ".join(f"{method} {_shown(found[method])}" for method in best) or "none"


def _shown(one: Expected) -> str:
    high = f"{one.high:.3g}" if np.isfinite(one.high) else "inf"
    return f"{one.value:.3g} ({one.low:.3g} to {high}, {one.successes}/{one.runs})"


def methods_table() -> Table:
    """All methods by name."""
    rows = []
    for one in METHODS.values():
        takes = "several goals" if one.goals[0] > 1 else "one goal or several"
        rest = [takes] if one.goals != (1, 1) else []
        rest += [", ".join(one.families)] if one.families else []
        rest += ["convex"] if one.convex else []
        rest += [f"{one.most} numbers at most"] if one.most < 10**9 else []
        asks = "gradients" if one.slopes else (f"batches of {one.batch}" if one.batch > 1 else "")
        rows.append(
            [f"`{one.name}`", one.library, one.what, asks, one.constraints, "; ".join(rest)]
        )
    heads = ("method", "library", "what", "asks for", "constraints", "takes only")
    return Table([Column(head, words=True) for head in heads], rows)
