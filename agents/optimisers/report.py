"""Results of races: how close each method came, how soon, and ECDF plots."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.optimisers.measures import COSTS, TARGETS, Cost, ecdf, ert, gaps, scale_of
from stickslip.agents.optimisers.results import FAILED, OUTCOMES
from stickslip.agents.pictures.plots import make_sheet, name_below, save_sheet
from stickslip.envs.rendering import theme
from stickslip.optim.instances.catalogue import suite
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from stickslip.agents.optimisers.results import Run

CLOSE = 0.01
"""Relative gap of "close", and of expected running times."""
FIRST, NAMED = 3, 10
"""Methods named for an instance; failed runs named."""
FAMILIES = {
    "posture": "leg angles of the UGV",
    "split": "torque split (convex)",
    "gait": "gaits (convex)",
    "shooting": "torques through the simulator",
    "gains": "feedback gains (noisy)",
    "design": "designs",
    "goals": "two goals",
}
COLOURS = ("#0072B2", "#D55E00", "#008069", "#7B6A8D", "#E69F00", "#56B4E9", "#CC79A7", "#111111")
DASHES = ("-", (0, (4, 1.5)), (0, (1, 1.2)))
LABELS = {"evaluations": "evaluations / free numbers", "seconds": "processor time [s]"}
COLUMNS = 3


def report_text(runs: Sequence[Run]) -> str:
    """The report in Markdown."""
    heading = f"Median gap at the end (share of runs within {CLOSE:.0%}):\n"
    parts = [counted_text(runs), heading, closeness_table(runs).markdown(aligned=True)]
    if single := [run for run in runs if len(suite()[run.instance].goals) == 1]:
        heading = f"The first {FIRST} methods (interval, runs that hit it / runs):\n"
        parts += [heading, first_table(single).markdown(aligned=True)]
    return "\n".join(parts)


def counted_text(runs: Sequence[Run]) -> str:
    """Number of runs, outcomes, costs and the failures."""
    outcomes = Counter(run.outcome for run in runs)
    words = ", ".join(f"{outcomes[one]} {one}" for one in OUTCOMES if outcomes[one])
    seconds = sum(float(np.nan_to_num(run.seconds[-1])) for run in runs)
    spent = sum(int(run.evaluations[-1]) for run in runs)
    instances, methods = ({getattr(run, of) for run in runs} for of in ("instance", "method"))
    lines = [
        f"{len(runs)} runs of {len(methods)} methods on {len(instances)} instances: {words}; "
        f"{spent:,} evaluations, {seconds:,.0f} s of processor time."
    ]
    if moved := sum(run.counts["clipped"] + run.counts["refused"] for run in runs):
        lines.append(f"{moved:,} points lay out of bounds and were moved in or refused.")
    failed = [run for run in runs if run.outcome in FAILED]
    for run in failed[:NAMED]:
        name = f"{run.method} on {run.instance}, seed {run.seed}"
        lines.append(f"- {name}: {run.outcome}, {run.message}")
    if len(failed) > NAMED:
        lines.append(f"- and {len(failed) - NAMED} more")
    return "\n".join(lines) + "\n"


def runs_table(runs: Sequence[Run]) -> Table:
    """A row for each run: where it ended. gap: relative to the best known value."""
    columns = [Column(name, words=True) for name in ("instance", "method", "seed", "outcome")]
    columns += [Column("evaluations"), Column("seconds", "s"), Column("best"), Column("gap")]
    rows = [
        [*run.key, run.outcome, run.evaluations[-1], run.seconds[-1], run.best, gaps(run)[-1]]
        for run in runs
    ]
    return Table(columns, rows)


def closeness_table(runs: Sequence[Run]) -> Table:
    """Median gap at the end and the share of runs within CLOSE, by method and family."""
    names = _families(runs)
    columns = [Column("method", words=True)]
    columns += [Column(FAMILIES[name], words=True) for name in names]
    rows = [
        [
            method,
            *(_closeness([one for one in runs if one.method == method], name) for name in names),
        ]
        for method in _methods(runs)
    ]
    return Table(columns, rows)


def _closeness(runs: Sequence[Run], family: str) -> str:
    ends = np.array([gaps(run)[-1] for run in runs if suite()[run.instance].family == family])
    if not len(ends):
        return ""
    known, close = np.isfinite(ends), f"({np.mean(ends <= CLOSE):.0%})"
    if not known.any():
        return f"none feasible {close}"
    if known.mean() <= 0.5:
        return f"{known.mean():.0%} feasible {close}"
    return f"{max(float(np.median(ends)), 0):.2g} {close}"


def first_table(runs: Sequence[Run]) -> Table:
    """For each instance the methods that come within CLOSE first, by evaluations and by time."""
    heads = (
        "instance",
        "expected evaluations to 1 %, with interval",
        "expected processor time [s]",
    )
    rows = []
    for name in dict.fromkeys(run.instance for run in runs):
        here = [run for run in runs if run.instance == name]
        cells = (_first(comparable(here, cost), cost) for cost in COSTS)
        rows.append([f"`{name}`", *cells])
    return Table([Column(head, words=True) for head in heads], rows)


def _first(runs: Sequence[Run], cost: Cost) -> str:
    found = {
        method: ert([run for run in runs if run.method == method], CLOSE, cost)
        for method in _methods(runs)
    }
    hit = sorted((one.value, name) for name, one in found.items() if np.isfinite(one.value))
    words = []
    for _, name in hit[:FIRST]:
        value, low, high, successes, count = found[name]
        words.append(f"{name} {value:.3g} ({low:.3g} to {high:.3g}, {successes}/{count})")
    return "; ".join(words) or "none"


def comparable(runs: Sequence[Run], cost: Cost) -> list[Run]:
    """Runs whose cost says something: evaluations unless the method works on the problem itself,
    seconds where they are known."""
    if cost == "evaluations":
        return [run for run in runs if not run.inside]
    return [run for run in runs if np.all(np.isfinite(run.seconds))]


def draw_ecdfs(runs: Sequence[Run], folder: Path) -> list[Path]:
    """Write ecdf_evaluations.png and ecdf_seconds.png, a panel for each family: the share
    of pairs of run and target that are hit; a cross where the runs end. Return the paths."""
    single = [run for run in runs if len(suite()[run.instance].goals) == 1]
    styles = {
        name: {"color": COLOURS[i % len(COLOURS)], "linestyle": DASHES[i // len(COLOURS) % 3]}
        for i, name in enumerate(_methods(runs))
    }
    found = []
    for cost in COSTS:
        shown = comparable(single, cost)
        if not shown:
            continue
        names = _families(shown)
        columns = min(COLUMNS, len(names))
        rows = -(-len(names) // columns)
        title = (
            f"Targets hit, by {cost}: {len(TARGETS)} gaps from {TARGETS[0]:g} to {TARGETS[-1]:g}"
        )
        figure, axes = make_sheet(rows, columns, (max(3.7 * columns + 1.9, 8), 3 * rows), title)
        for axis in axes[len(names) :]:
            axis.set_axis_off()
        for axis, name in zip(axes, names, strict=False):
            here = [run for run in shown if suite()[run.instance].family == name]
            for method in _methods(here):
                mine = [run for run in here if run.method == method]
                at, share = ecdf(mine, cost)
                last = max(float(getattr(one, cost)[-1]) / scale_of(one, cost) for one in mine)
                end = share[-1] if len(share) else 0.0
                x = np.append(at, max([last, *at[-1:]]))
                axis.step(x, np.append(share, end), where="post", lw=1.4, **styles[method])
                axis.plot(x[-1], end, "x", color=styles[method]["color"], markersize=4)
            axis.set_xscale("log")
            axis.set_ylim(0, 1.02)
            axis.set_title(FAMILIES[name], loc="left", fontsize=9.5, color=theme.INK)
            name_below(axis, LABELS[cost])
        lines = [axes[0].plot([], [], lw=1.4, **styles[name])[0] for name in _methods(shown)]
        figure.legend(lines, _methods(shown), loc="outside right center", fontsize=8.5,
                      frameon=False)  # fmt: skip
        found.append(save_sheet(figure, folder / f"ecdf_{cost}.png"))
    return found


def _families(runs: Sequence[Run]) -> list[str]:
    """Families of the runs, in the order of FAMILIES."""
    here = {suite()[run.instance].family for run in runs}
    return [name for name in FAMILIES if name in here]


def _methods(runs: Sequence[Run]) -> list[str]:
    return list(dict.fromkeys(run.method for run in runs))
