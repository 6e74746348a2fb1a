"""Results of races: gaps, expected running times, ECDF plots, and files for IOHprofiler."""

from __future__ import annotations

import json
import re
from collections import Counter
from importlib.metadata import version
from itertools import groupby
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

import numpy as np

from stickslip.agents.optimisers.runs import FAILED, OUTCOMES
from stickslip.dynamics.plain_checks import require_choice
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.sheet import make_sheet, name_below, save_sheet
from stickslip.optim.instances.catalogue import suite
from stickslip.records.files import write_whole
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from jaxtyping import Float

    from stickslip.agents.optimisers.runs import Run
    from stickslip.optim.instances.instance import Instance

Cost: TypeAlias = Literal["evaluations", "seconds"]
COSTS: tuple[Cost, Cost] = ("evaluations", "seconds")
TARGETS = 10.0 ** np.linspace(2, -4, 31)
"""Relative gaps to the best known value: five in each power of ten."""
LEVEL, RESAMPLES = 0.95, 1000
LEAST, REFERENCE = 1e-12, 1.1


class Target(NamedTuple):
    """The best known value, and the size that gaps are relative to."""

    best: float
    scale: float

    @classmethod
    def of(cls, instance: Instance) -> Target:
        """The target of an instance; with several goals 0 and 1, see `front_merit`."""
        if len(instance.goals) > 1:
            return cls(0.0, 1.0)
        return cls(instance.best_known, max(abs(instance.best_known), LEAST))

    def gap(self, value: float | np.ndarray) -> np.ndarray:
        """(value - best) / scale: 0 for the best known, negative for what is better."""
        return (np.asarray(value, float) - self.best) / self.scale


def front_merit(instance: Instance, values: Float[np.ndarray, "B 2"]) -> float:
    """Share of the known front's hypervolume that points miss; goals are scaled to 0 and 1 on the
    front, and the reference point is (1.1, 1.1)."""
    front = None if instance.known is None else instance.known.front
    if front is None or front.shape[1] != 2:
        raise ValueError(f"{instance.id}: no front of two goals is known")
    low, high = front.min(axis=0), front.max(axis=0)
    found, known = (hypervolume((one - low) / (high - low), REFERENCE) for one in (values, front))
    return 1.0 - found / known


def hypervolume(values: Float[np.ndarray, "B 2"], reference: float) -> float:
    """The area that points of two goals, both minimised, dominate up to (reference, reference)."""
    inside = values[np.all(values < reference, axis=1)]
    area, least = 0.0, reference
    for first, second in inside[np.lexsort((inside[:, 1], inside[:, 0]))]:
        if second < least:
            area += (reference - first) * (least - second)
            least = second
    return float(area)


class Expected(NamedTuple):
    """Expected running time with a bootstrap interval of LEVEL over runs; infinite where no run
    hit. successes, runs: how many did, of how many."""

    value: float
    low: float
    high: float
    successes: int
    runs: int


def gaps(run: Run) -> Float[np.ndarray, "rows"]:
    """(value - best known) / |best known| by row; infinite before something is feasible. With two
    goals: the missing share of hypervolume."""
    found = Target.of(suite()[run.instance]).gap(run.values)
    return np.where(np.isfinite(found), found, np.inf)


def hits(run: Run, targets: Float[np.ndarray, "T"], of: Cost) -> Float[np.ndarray, "T"]:
    """Cost at which each gap was first reached; infinite where it was not."""
    require_choice("of", of, COSTS)
    met = gaps(run)[:, None] <= np.asarray(targets, float)[None, :]
    spent = np.asarray(getattr(run, of), float)
    return np.where(met.any(axis=0), spent[np.argmax(met, axis=0)], np.inf)


def ert(runs: Sequence[Run], target: float, of: Cost = "evaluations", seed: int = 0) -> Expected:
    """Expected running time to a gap: what all runs spent until they hit it or ended, over the
    number of hits (Auger and Hansen 2005), for runs of one method on one instance. Wide for few
    runs, and infinite above where resamples have no success."""
    found = np.array([hits(run, np.array([target]), of)[0] for run in runs])
    hit, ends = np.isfinite(found), np.array([float(getattr(run, of)[-1]) for run in runs])
    spent = np.where(hit, found, ends)
    which = np.random.default_rng(seed).integers(len(runs), size=(RESAMPLES, len(runs)))
    drawn = np.sort(_ratio(spent[which].sum(axis=1), hit[which].sum(axis=1)))
    tail = (1 - LEVEL) / 2
    low, high = (drawn[round(share * (RESAMPLES - 1))] for share in (tail, 1 - tail))
    value = _ratio(spent.sum(), hit.sum())
    return Expected(float(value), float(low), float(high), int(hit.sum()), len(runs))


def _ratio(spent: np.ndarray, hit: np.ndarray) -> np.ndarray:
    return np.where(hit > 0, spent / np.maximum(hit, 1), np.inf)


def ecdf(
    runs: Iterable[Run], of: Cost, targets: Float[np.ndarray, "T"] = TARGETS
) -> tuple[Float[np.ndarray, "P"], Float[np.ndarray, "P"]]:
    """Share of all pairs of run and target hit by a cost: where it rises, and to what.

    Evaluations are divided by the instance's free numbers, as is usual; seconds are not.
    """
    each = [hits(run, targets, of) / scale_of(run, of) for run in runs]
    if not each:
        return np.zeros(0), np.zeros(0)
    ordered = np.sort(np.concatenate(each))
    known = np.isfinite(ordered)
    return ordered[known], (np.flatnonzero(known) + 1) / len(ordered)


def scale_of(run: Run, of: Cost) -> int:
    """Scale of the costs in an ECDF."""
    return suite()[run.instance].n if of == "evaluations" else 1


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
