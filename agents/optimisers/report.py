"""Runs of optimisers, as a race keeps them, and reports: gaps, running times, ECDFs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeAlias

import numpy as np

from stickslip.agents.sweeps.cells import CELL_FILE, cell_files
from stickslip.agents.untrusted import RefusedError, reading
from stickslip.dynamics.checks import reraise
from stickslip.envs.rendering.sheet import WIDTH, make_sheet, name_panel, save_sheet, styled
from stickslip.optim.instances.instance import FAMILIES, SEEDED, Instance, instance
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    import pyarrow as pa
    from jaxtyping import Float, Int


OUTCOMES = ("spent", "ended", "raised", "timed out", "died")
"""The budget ended it, it ended by itself, it raised, its process was killed, its process ended."""
COUNTED = ("values", "gradients", "repeated", "batches", "clipped", "not_numbers")
"""Counters of `Record` that a run keeps."""
ARRAYS = {"evaluations": np.int64, "seconds": float, "values": float, "point": float}
STORED = Path(__file__).parent / "results.parquet"
DIGITS = 12
"""Digits of a digest that are compared."""


@dataclass(frozen=True)
class Run:
    """One run of a method on an instance with a seed.

    outcome: of OUTCOMES. message: why it failed. inside: whether the method works on the problem
    itself. counts: by COUNTED. digest: of the instance.
    evaluations: values and gradients so far; seconds: processor time so far [s]; values: best
    feasible value so far, see EventRecord, NaN for none [rows]: one for each improvement, the last
    of the end. point: free numbers of the last value.
    """

    instance: str
    method: str
    seed: int
    outcome: str
    message: str
    inside: bool
    counts: Mapping[str, int]
    digest: str
    evaluations: Int[np.ndarray, "rows"] = field(repr=False)
    seconds: Float[np.ndarray, "rows"] = field(repr=False)
    values: Float[np.ndarray, "rows"] = field(repr=False)
    point: Float[np.ndarray, "n"] | None = field(repr=False, default=None)

    @property
    def key(self) -> tuple[str, str, int]:
        """Instance, method and seed."""
        return self.instance, self.method, self.seed

    @property
    def best(self) -> float:
        """The best feasible value; NaN where there is none."""
        return float(self.values[-1])

    def table(self) -> pa.Table:
        """An Arrow table of one row, arrays as lists."""
        import pyarrow as pa

        row = vars(self)
        lists = {name: row[name].tolist() for name in ARRAYS if row[name] is not None}
        return pa.Table.from_pylist([row | lists])


def read_results(*paths: str | Path) -> list[Run]:
    """Runs of races' directories, or of Parquet files of many runs, together.

    ValueError naming the file or directory: for damage, unknown instances, instances with other
    numbers, and for runs that two directories hold.
    """
    if not paths:
        raise ValueError("no directory; accepted: one at least")
    found: dict[tuple[str, str, int], tuple[Path, Run]] = {}
    for path in map(Path, paths):
        files = [path] if path.is_file() else cell_files(path, "race").values()
        for run in (run for file in files for run in _read(file)):
            if (other := found.setdefault(run.key, (path, run))[0]) != path:
                raise ValueError(
                    f"{path}: {run.method} on {run.instance} with seed {run.seed} is also in "
                    f"{other}; accepted: each run once; give yours another method's name"
                )
    return [run for _, run in found.values()]


def stored_results(runs: Iterable[Run]) -> list[Run]:
    """The package's own runs (docs/suite.md) on the same instances, by methods that `runs` lack."""
    on, own = {run.instance for run in runs}, {run.method for run in runs}
    return _read(STORED, [("instance", "in", on), ("method", "not in", own)])


def _read(file: Path, filters: Any = None) -> list[Run]:
    from pyarrow import parquet

    with reading(file, CELL_FILE):
        return [_run_of(row) for row in parquet.read_table(file, filters=filters).to_pylist()]


def _run_of(row: dict[str, Any]) -> Run:
    lists = {name: np.array(row[name], of) for name, of in ARRAYS.items() if row[name] is not None}
    run = Run(**{**row, **lists})
    with reraise("", kind=RefusedError):
        known = instance(run.instance).known
    if known and not known.digest.startswith(run.digest[:DIGITS]):
        raise RefusedError(f"digest {run.digest} is not that of {run.instance} here")
    return run


Cost: TypeAlias = Literal["evaluations", "seconds"]
COSTS: tuple[Cost, Cost] = ("evaluations", "seconds")
TARGETS = 10.0 ** np.linspace(2, -4, 31)
"""Relative gaps to the best known value: five in each power of ten."""
LEVEL, RESAMPLES = 0.95, 1000
LEAST = 1e-12
CLOSE = 0.01
"""Relative gap of "close", and of expected running times."""
FIRST = 3
"""Methods named for an instance."""
COLOURS = ("#0072B2", "#D55E00", "#008069", "#7B6A8D", "#E69F00", "#56B4E9", "#CC79A7", "#111111")
DASHES = ("-", (0, (4, 1.5)), (0, (1, 1.2)))
LABELS = {"evaluations": "evaluations / free numbers", "seconds": "processor time [s]"}


def gap(instance: Instance, value: float | np.ndarray) -> np.ndarray:
    """(value - best known) / |best known|: negative for what is better; NaN where none is known."""
    best = instance.best_known if instance.known else np.nan
    return (np.asarray(value, float) - best) / max(abs(best), LEAST)


class Expected(NamedTuple):
    """Expected running time with a bootstrap interval of LEVEL over runs; infinite where no run
    hit. successes, runs: how many did, of how many."""

    value: float
    low: float
    high: float
    successes: int
    runs: int


def gaps(run: Run) -> Float[np.ndarray, "rows"]:
    """(value - best known) / |best known| by row; infinite before something is feasible."""
    found = gap(instance(run.instance), run.values)
    return np.where(np.isfinite(found), found, np.inf)


def hits(run: Run, targets: Float[np.ndarray, "T"], of: Cost) -> Float[np.ndarray, "T"]:
    """Cost at which each gap was first reached; infinite where it was not."""
    met = gaps(run)[:, None] <= np.asarray(targets, float)[None, :]
    spent = np.asarray(getattr(run, of), float)
    return np.where(met.any(axis=0), spent[np.argmax(met, axis=0)], np.inf)


def ert(runs: Sequence[Run], target: float, of: Cost = "evaluations", seed: int = 0) -> Expected:
    """Expected running time to a gap: what all runs spent until they hit it or ended, over the
    number of hits (Auger and Hansen 2005), for runs of one method on one function. Wide for few
    runs, and infinite above where resamples have no success."""
    found = np.array([hits(run, np.array([target]), of)[0] for run in runs])
    hit, ends = np.isfinite(found), np.array([float(getattr(run, of)[-1]) for run in runs])
    spent = np.where(hit, found, ends)
    which = np.random.default_rng(seed).integers(len(runs), size=(RESAMPLES, len(runs)))
    which = np.concatenate([[np.arange(len(runs))], which])
    times, successes = spent[which].sum(axis=1), hit[which].sum(axis=1)
    value, *drawn = np.where(successes > 0, times / np.maximum(successes, 1), np.inf)
    tail = (1 - LEVEL) / 2
    low, high = (np.sort(drawn)[round(at * (RESAMPLES - 1))] for at in (tail, 1 - tail))
    return Expected(float(value), float(low), float(high), int(hit.sum()), len(runs))


def ecdf(
    runs: Iterable[Run], of: Cost, targets: Float[np.ndarray, "T"] = TARGETS
) -> tuple[Float[np.ndarray, "P"], Float[np.ndarray, "P"]]:
    """Share of all pairs of run and target hit by a cost: where it rises, and to what.

    Evaluations are divided by the instance's free numbers, as is usual; seconds are not.
    """
    each = [hits(run, targets, of) / _scale(run, of) for run in runs]
    ordered = np.sort(np.concatenate([*each, np.zeros(0)]))
    known = np.isfinite(ordered)
    return ordered[known], (np.flatnonzero(known) + 1) / max(len(ordered), 1)


def _scale(run: Run, of: Cost) -> int:
    return instance(run.instance).n if of == "evaluations" else 1


def report_text(runs: Sequence[Run]) -> str:
    """The report in Markdown."""
    heading = f"Median gap at the end (share of runs within {CLOSE:.0%}):\n"
    first = f"The first {FIRST} methods (interval, runs that hit it / runs):\n"
    parts = [counted_text(runs), heading, closeness_table(runs).markdown(aligned=True)]
    return "\n".join([*parts, first, first_table(runs).markdown(aligned=True)])


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
    odd = {"clipped": "lay out of bounds and were moved in", "not_numbers": "held no numbers"}
    for name, words in odd.items():
        if count := sum(run.counts[name] for run in runs):
            lines.append(f"{count:,} points {words}.")
    for run in (run for run in runs if run.outcome not in ("spent", "ended")):
        said = " ".join(f"{run.outcome}, {run.message}".split())
        lines.append(f"- {run.method} on {run.instance}, seed {run.seed}: {said}")
    return "\n".join(lines) + "\n"


def closeness_table(runs: Sequence[Run]) -> Table:
    """Median gap at the end and the share of runs within CLOSE, by method and family."""
    families = _by_family(runs)
    columns = [Column(name, words=True) for name in ("method", *(FAMILIES[at] for at in families))]
    each = [grouped(here) for here in families.values()]
    rows = [[name, *(_closeness(of.get(name, [])) for of in each)] for name in grouped(runs)]
    return Table(columns, rows)


def _closeness(runs: Sequence[Run]) -> str:
    ends = np.array([gaps(run)[-1] for run in runs if instance(run.instance).known])
    if not len(ends):
        return ""
    known, close = np.isfinite(ends), f"({np.mean(ends <= CLOSE):.0%})"
    if not known.any():
        return f"none feasible {close}"
    if known.mean() <= 0.5:
        return f"{known.mean():.0%} feasible {close}"
    return f"{max(float(np.median(ends)), 0):.2g} {close}"


def first_table(runs: Sequence[Run]) -> Table:
    """Methods that come within CLOSE first, by evaluations and by time, for each function, whose
    seeded instances count together."""
    heads = ("function", "expected evaluations to 1 %, interval", "expected processor time [s]")
    rows = [
        [f"`{name}`", *(_first(_comparable(here, cost), cost) for cost in COSTS)]
        for name, here in grouped(runs, function_of).items()
    ]
    return Table([Column(head, words=True) for head in heads], rows)


def function_of(run: Run) -> str:
    """Id of its instance without the seed."""
    seeded = SEEDED.fullmatch(run.instance)
    return seeded[1] if seeded else run.instance


def _first(runs: Sequence[Run], cost: Cost) -> str:
    found = [(ert(mine, CLOSE, cost), name) for name, mine in grouped(runs).items()]
    hit = sorted((one.value, name, one) for one, name in found if np.isfinite(one.value))
    words = (
        f"{name} {one.value:.3g} ({one.low:.3g} to {one.high:.3g}, {one.successes}/{one.runs})"
        for _, name, one in hit[:FIRST]
    )
    return "; ".join(words) or "none"


def _comparable(runs: Sequence[Run], cost: Cost) -> list[Run]:
    """Runs whose cost says something: evaluations unless the method works on the problem itself,
    seconds where they are known."""
    if cost == "evaluations":
        return [run for run in runs if not run.inside]
    return [run for run in runs if np.all(np.isfinite(run.seconds))]


def _by_family(runs: Sequence[Run]) -> dict[str, list[Run]]:
    """Runs by family, in the order of FAMILIES."""
    found = grouped(runs, lambda run: instance(run.instance).family)
    return {name: found[name] for name in FAMILIES if name in found}


def grouped(
    runs: Sequence[Run], of: Callable[[Run], str] = lambda run: run.method
) -> dict[str, list[Run]]:
    """Runs by method or by something else, in the order of the runs."""
    found: dict[str, list[Run]] = {}
    for run in runs:
        found.setdefault(of(run), []).append(run)
    return found


@styled
def draw_ecdfs(runs: Sequence[Run], folder: Path) -> list[Path]:
    """Write ecdf_evaluations.png and ecdf_seconds.png, a panel for each family: the share
    of pairs of run and target that are hit; a cross where the runs end. Return the paths."""
    styles: dict[str, dict[str, Any]] = {
        name: {"color": COLOURS[i % len(COLOURS)], "linestyle": DASHES[i // len(COLOURS) % 3]}
        for i, name in enumerate(grouped(runs))
    }
    chosen: dict[Cost, list[Run]] = {cost: _comparable(runs, cost) for cost in COSTS}
    return [_draw(here, cost, styles, folder) for cost, here in chosen.items() if here]


def _draw(runs: Sequence[Run], cost: Cost, styles: dict[str, dict[str, Any]], folder: Path) -> Path:
    families = _by_family(runs)
    columns = min(3, len(families))
    rows = -(-len(families) // columns)
    title = f"Share of targets hit ({len(TARGETS)} gaps from {TARGETS[0]:g} to {TARGETS[-1]:g})"
    figure, axes = make_sheet(rows, columns, (max(2.6 * columns, WIDTH), 2.4 * rows + 1.2), title)
    for axis in axes[len(families) :]:
        axis.set_axis_off()
    for axis, (family, here) in zip(axes, families.items(), strict=False):
        for method, mine in grouped(here).items():
            at, share = ecdf(mine, cost)
            ends = [float(getattr(one, cost)[-1]) / _scale(one, cost) for one in mine]
            x, y = np.append(at, max([*ends, *at])), np.append(share, max([0.0, *share]))
            axis.step(x, y, where="post", **styles[method])
            axis.plot(x[-1], y[-1], "x", color=styles[method]["color"], markersize=4)
        axis.set_xscale("log")
        axis.set_ylim(0, 1.02)
        name_panel(axis, FAMILIES[family], "", LABELS[cost])
    names = list(grouped(runs))
    lines = [axes[0].plot([], [], **styles[name])[0] for name in names]
    figure.legend(lines, names, loc="outside lower center", ncols=5)
    return save_sheet(figure, folder / f"ecdf_{cost}.png")
