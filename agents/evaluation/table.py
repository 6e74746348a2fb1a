"""Evaluations as tables: a row for each scene and controller, with 95 % confidence intervals."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from itertools import chain
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeAlias, TypeVar

import jax.numpy as jnp
import numpy as np

from stickslip.agents.protocol import Params_contra, State_contra
from stickslip.envs.tasks.known import CONFIDENCE, UNKNOWN, Interval
from stickslip.records import table
from stickslip.records.files import write_whole
from stickslip.records.table import Table, json_text

if TYPE_CHECKING:
    from jaxtyping import Array
    from numpy.typing import ArrayLike

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.agents.protocol import Timed

INTERVALS = ("return", "task_score")
"""Metrics of a test during training whose interval is written, too."""


@dataclass(frozen=True)
class Column(table.Column):
    """decimals: at most, of the value. percent: the value is a share, shown with both ends of its
    interval, which is not symmetric. undefined: what is shown for NaN."""

    decimals: int = 0
    percent: bool = False
    undefined: str = "-"

    def show(self, given: Interval) -> str:
        """The estimate and half the width of its interval."""
        if not isfinite(given.value):
            return self.undefined
        if self.percent:
            ends = "" if not isfinite(given.low) else f" ({given.low:.0%} to {given.high:.0%})"
            return f"{given.value:.0%}{ends}".replace("%", "")
        return given.shown(self.decimals).replace("-", "−")


Kept = TypeVar("Kept")
Columns: TypeAlias = Mapping[str, tuple[Column, Callable[[Kept], Interval]]]
"""Metrics by name: how each is shown, and how it comes from a machine's episodes."""


Say: TypeAlias = Callable[[str], None]


@dataclass(frozen=True)
class Measures(Generic[State_contra, Params_contra, Kept]):
    """Kept data of an episode, and the metrics of it.

    keep: (rollout, parameters) -> a NamedTuple of numbers, traced; evaluations hold it with arrays
    [episodes]. It has `reward` and says which episodes ended outside the model, `fell`. kept: its
    entries that a sweep writes, with units. cost: an episode's mean, where a task limits it.
    """

    keep: Callable[[Rollout[State_contra], Params_contra], Kept]
    columns: Columns[Kept]
    kept: Mapping[str, str]
    cost: tuple[Column, Callable[[Kept], Interval]] | None = None


@dataclass(frozen=True)
class Row:
    """One controller in one scene. metrics: by the names of the columns, in SI units."""

    scene: str
    controller: str
    metrics: dict[str, Interval]
    episodes: Any
    """Kept data of each episode; every entry [episodes]."""

    @property
    def count(self) -> int:
        """Number of episodes."""
        return len(self.episodes.reward)


@dataclass(frozen=True)
class Evaluation:
    """A table with one row for each scene and controller.

    Intervals are 95 %: Student's t over episodes for means and for the ratios per metre (totals
    over totals), Wilson's for shares of episodes, the bootstrap for scores (`Known.score`). Where a
    reset draws nothing every seed is the same episode: it is run once, and there are no intervals.
    What is not defined is NaN, shown as "-".
    """

    rows: tuple[Row, ...]
    seeds: tuple[int, ...]
    columns: Columns[Any]

    def row(self, scene: str, controller: str) -> Row:
        """The row of that scene and controller; ValueError if there is none."""
        for row in self.rows:
            if (row.scene, row.controller) == (scene, controller):
                return row
        known = ", ".join(f"{row.scene}/{row.controller}" for row in self.rows)
        raise ValueError(f"no row {scene}/{controller}; accepted: {known}")

    def to_text(self) -> str:
        """The table for a terminal: aligned, with a note where fewer episodes were played."""
        alike = [row.scene for row in self.rows if row.count < len(self.seeds)]
        note = (
            f"\nNothing is drawn in {', '.join(dict.fromkeys(alike))}: all {len(self.seeds)} "
            "episodes are the same one, which was played once.\n"
        )
        return self.shown().terminal(grouped=True) + (note if alike else "")

    def _repr_html_(self) -> str:
        """The same in a notebook."""
        return f"<pre>{escape(self.to_text())}</pre>"

    def write_csv(self, path: str | Path) -> Path:
        """One line a row, three columns a metric (value, low, high); empty where undefined."""
        flat = self.as_table()
        heads = [table.Column(column.name) for column in flat.columns]
        return write_whole(path, Table(heads, flat.rows).csv())

    def as_table(self) -> Table:
        """Every number in SI units: a row each, three columns a metric (value, low, high)."""
        units, names = self._units(), self.rows[0].metrics if self.rows else ()
        ends = ("", "_low", "_high")
        heads = [table.Column(f"{one}{end}", units[one]) for one in names for end in ends]
        return self._table(heads, lambda row: chain(*row.metrics.values()))

    def write_json(self, path: str | Path, about: Mapping[str, object] | None = None) -> Path:
        """Everything, each episode included; null where undefined. about: further entries."""
        rows = [
            {
                "scene": row.scene,
                "controller": row.controller,
                "episodes": row.count,
                "metrics": {name: value._asdict() for name, value in row.metrics.items()},
                "per_episode": row.episodes._asdict() | {"fell": row.episodes.fell},
            }
            for row in self.rows
        ]
        head = {"confidence": CONFIDENCE, "units": self._units(), "seeds": list(self.seeds)}
        return write_whole(path, json_text({**(about or {}), **head, "rows": rows}))

    def _units(self) -> dict[str, str]:
        heads = {name: column for name, (column, _) in self.columns.items()}
        return {name: "-" if one.percent else one.unit for name, one in heads.items()}

    def shown(self) -> Table:
        """The rows with their titles and units, numbers as they are shown."""
        heads = {name: column for name, (column, _) in self.columns.items()}
        return self._table(
            heads.values(), lambda row: (heads[name].show(one) for name, one in row.metrics.items())
        )

    def _table(
        self, heads: Iterable[table.Column], cells: Callable[[Row], Iterable[object]]
    ) -> Table:
        words = (table.Column(name, words=True) for name in ("scene", "controller"))
        rows = [[row.scene, row.controller, row.count, *cells(row)] for row in self.rows]
        return Table([*words, table.Column("episodes"), *heads], rows)


def joined(parts: Sequence[Evaluation], order: Sequence[str]) -> Evaluation:
    """One table of several over the same seeds and columns, scene by scene, in the order given."""
    rows = [row for part in parts for row in part.rows]
    scenes = list(dict.fromkeys(row.scene for row in rows))
    rows.sort(key=lambda row: (scenes.index(row.scene), order.index(row.controller)))
    return replace(parts[0], rows=tuple(rows))


def row_of_test(columns: Columns[Kept], kept: Kept) -> dict[str, float]:
    """The metrics of episodes kept, and <name>_low, <name>_high of those in INTERVALS."""
    found = {name: metric(kept) for name, (_, metric) in columns.items()}
    row = {name: one.value for name, one in found.items()}
    for name in filter(found.get, INTERVALS):
        row |= {f"{name}_low": found[name].low, f"{name}_high": found[name].high}
    return row


def mean_interval(values: ArrayLike) -> Interval:
    """Mean of independent episodes with Student's t interval; none from a single episode."""
    values = np.asarray(values, float)
    return _student(float(values.mean()), values - values.mean())


def ratio_interval(above: ArrayLike, below: ArrayLike, least: float) -> Interval:
    """Sum over sum, undefined (NaN) unless the mean of `below` is at least `least`.

    The interval is Student's t on the linearised residuals (above - ratio x below) / mean(below),
    the usual one for a ratio estimator (Cochran, Sampling Techniques, ch. 6): unlike the mean of
    the episodes' own ratios it is not upset by an episode that went nowhere.
    """
    above, below = np.asarray(above, float), np.asarray(below, float)
    if not below.mean() >= least:
        return Interval(UNKNOWN)
    ratio = float(above.sum() / below.sum())
    return _student(ratio, (above - ratio * below) / below.mean())


def fraction_interval(happened: ArrayLike) -> Interval:
    """Share of episodes in which something happened, with Wilson's score interval."""
    happened = np.asarray(happened, bool)
    share = float(happened.mean())
    if happened.size < 2:
        return Interval(share)
    from scipy.stats import binomtest

    test = binomtest(int(happened.sum()), happened.size)
    low, high = test.proportion_ci(CONFIDENCE, "wilson")
    return Interval(share, float(low), float(high))


def _student(value: float, residuals: np.ndarray) -> Interval:
    n = residuals.size
    if n < 2 or not np.isfinite(value):
        return Interval(value)
    from scipy.special import stdtrit

    spread = np.sqrt(float(np.sum(residuals**2)) / (n - 1) / n)
    half = float(stdtrit(n - 1, (1 + CONFIDENCE) / 2)) * spread
    return Interval(value, value - half, value + half)


class StandardEpisodes(NamedTuple):
    """Kept data of each episode; every entry [episodes].

    reward: sum. duration: steps times control period [s]. terminated: not by the time limit.
    """

    reward: Array | np.ndarray
    duration: Array | np.ndarray
    terminated: Array | np.ndarray

    @property
    def fell(self) -> np.ndarray:
        """Ended before its time."""
        return np.asarray(self.terminated)


def keep_of(rollout: Rollout[object], params: Timed) -> StandardEpisodes:
    """Kept data of an episode."""
    real = jnp.arange(len(rollout.reward)) < rollout.length
    earned, lasted = jnp.where(real, rollout.reward, 0.0), rollout.length * params.control_period
    return StandardEpisodes(jnp.sum(earned), lasted, rollout.terminated[-1])


FAILURES = Column("failures", "%", 0, percent=True), lambda e: fraction_interval(e.fell)
COLUMNS: Columns[StandardEpisodes] = {
    "return": (Column("return", "-", 2), lambda kept: mean_interval(kept.reward)),
    "duration": (Column("length", "s", 1), lambda kept: mean_interval(kept.duration)),
    "failures": FAILURES,
}
MEASURES = Measures(keep_of, COLUMNS, {"reward": "-", "duration": "s"})
