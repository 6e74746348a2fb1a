"""Record of an optimiser's evaluations of an objective, in whatever process they are made.

In another process a copy of an objective returns numbers and arrays that carry, when they are
pickled, what was counted since the last. Unpickled in the first process, that is added to the
record. So any map over processes will do.
"""

from __future__ import annotations

import os
import time
from collections import Counter
from dataclasses import dataclass, field
from functools import wraps
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, cast
from uuid import uuid4
from weakref import WeakValueDictionary

import numpy as np

from stickslip.dynamics.numeric import read_only

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

F = TypeVar("F", bound="Callable[..., Any]")


class Seen(NamedTuple):
    """An evaluated point: what a record takes note of."""

    x: np.ndarray
    values: np.ndarray
    violation: float
    feasible: bool


@dataclass
class Home:
    """The process a record was made in, and what a copy elsewhere has not reported yet."""

    process: int = field(default_factory=os.getpid)
    name: str = field(default_factory=lambda: uuid4().hex)
    counts: Counter[str] = field(default_factory=Counter)
    seen: list[Seen] = field(default_factory=list)

    @property
    def here(self) -> bool:
        """True if this is the process."""
        return os.getpid() == self.process


class Improvement(NamedTuple):
    """A feasible point better than all before. evaluations, seconds: by then; value: its own."""

    evaluations: int
    seconds: float
    value: float


class BudgetSpent(Exception):  # noqa: N818 (an end, no error)
    """An optimiser asked for more than its budget, or after its time; what it found is kept.

    `Objective.minimise` takes it as the end; a loop of one's own may do the same.
    """

    home: Home | None = None
    """Home of an objective in another process that has not reported all its counts."""

    def __reduce__(self) -> tuple[Any, ...]:
        return reporting(type(self)(*self.args), self.home) or (type(self), self.args)


@dataclass
class Record:
    """Counters, and the best so far. Grows while an `Objective` is used.

    values, gradients: points at which these were computed, each once; batches: calls that computed
    many. clipped, refused, not_numbers: points that lay out of bounds and were moved in or refused,
    and points that were no numbers. improvements: of feasible points, for one goal alone. hits:
    (evaluations, seconds) by target. least_violation: of the points seen.
    """

    values: int = 0
    gradients: int = 0
    batches: int = 0
    clipped: int = 0
    refused: int = 0
    not_numbers: int = 0
    improvements: list[Improvement] = field(default_factory=list)
    hits: dict[float, tuple[int, float]] = field(default_factory=dict)
    best_x: np.ndarray | None = None
    least_violation: float = np.inf
    front: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)
    began: float = field(default_factory=time.perf_counter)
    targets: tuple[float, ...] = ()
    home: Home = field(init=False, repr=False, compare=False)

    def __post_init__(self):
        settle(self)

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"began": self.seconds}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Clocks of two processes need not begin together: seconds go on."""
        vars(self).update(state, began=time.perf_counter() - state["began"])
        if self.home.here:
            settle(self)

    @property
    def evaluations(self) -> int:
        """Evaluations that a budget counts: values and gradients."""
        return self.values + self.gradients

    @property
    def seconds(self) -> float:
        """Since the first evaluation, or since the objective was made."""
        return time.perf_counter() - self.began

    @property
    def best(self) -> float:
        """The least feasible value; infinite where there is none. Of a noisy instance it is the
        luckiest draw, as a rule far below what `Instance.value(best_x)` says, the mean of 256."""
        return self.improvements[-1].value if self.improvements else np.inf

    def count(self, name: str, by: int = 1) -> None:
        """Add to one of the counters."""
        setattr(self, name, getattr(self, name) + by)
        if not self.home.here:
            self.home.counts[name] += by

    def spent(self) -> BudgetSpent:
        """The end of the budget, or of the time."""
        error = BudgetSpent(f"{self.evaluations} evaluations in {self.seconds:.3g} s")
        error.home = None if self.home.here else self.home
        return error

    def take(self, counts: Mapping[str, int], seen: Sequence[Seen]) -> None:
        """Add what a copy in another process counted and saw."""
        for i, one in enumerate(seen):
            self.see(*one, self.evaluations + i + 1)
        for name, by in counts.items():
            self.count(name, by)

    def note(self, point: Seen) -> None:
        """Take note of the point counted last."""
        if not self.home.here:
            self.home.seen.append(point)
        self.see(*point, self.evaluations)

    def see(
        self, x: np.ndarray, values: np.ndarray, violation: float, feasible: bool, number: int
    ) -> None:
        """Keep a point, if it is better. number: of its evaluation."""
        self.least_violation = min(self.least_violation, violation)
        if not feasible or not np.all(np.isfinite(values)):
            return
        if len(values) > 1:
            self._keep_unbeaten(x, values)
        elif values[0] < self.best:
            self.improvements.append(Improvement(number, self.seconds, float(values[0])))
            self.best_x = read_only(x)
            for target in self.targets:
                if target not in self.hits and self.best <= target:
                    self.hits[target] = (number, self.seconds)

    def _keep_unbeaten(self, x: np.ndarray, values: np.ndarray) -> None:
        if any(np.all(other <= values) for _, other in self.front):
            return
        self.front = [one for one in self.front if not np.all(values <= one[1])]
        self.front.append((read_only(x), read_only(values)))


_made_here: WeakValueDictionary[str, Record] = WeakValueDictionary()


def settle(record: Record) -> None:
    """Give a new record, or a copy of one in its process, a name to report to."""
    record.home = Home()
    _made_here[record.home.name] = record


def reported(method: F) -> F:
    """The method of an Objective; what it returns away from home reports what was counted."""

    @wraps(method)
    def call(self: Any, *args: Any, **options: Any) -> Any:
        found = method(self, *args, **options)
        home = self.record.home
        return found if home.here else _reporting(found, home)

    return cast("F", call)


def _reporting(found: Any, home: Home) -> Any:
    if isinstance(found, tuple):
        return tuple(_reporting(one, home) for one in found)
    if isinstance(found, float):
        return ReportingNumber.of(found, home)
    array = np.asarray(found).view(ReportingArray)
    array.home = home
    return array


class ReportingNumber(float):
    """A float that reports."""

    home: Home

    @classmethod
    def of(cls, value: float, home: Home) -> ReportingNumber:
        """The number."""
        self = cls(value)
        self.home = home
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return reporting(float(self), self.home) or (float, (float(self),))


class ReportingArray(np.ndarray):
    """An array that reports; what is computed of it does not."""

    home: Home | None = None

    def __reduce_ex__(self, protocol: Any) -> Any:
        plain = np.array(self)
        return reporting(plain, self.home) or plain.__reduce_ex__(protocol)


def reporting(plain: Any, home: Home | None) -> tuple[Any, ...] | None:
    """Pickling of a value that reports; None where there is no home."""
    if home is None:
        return None
    counts, seen = home.counts, home.seen
    home.counts, home.seen = Counter(), []
    return _arrive, (plain, home.name, counts, seen)


def _arrive(value: Any, name: str, counts: Counter[str], seen: list[Seen]) -> Any:
    """The value, what was counted being added to the record, if that is here."""
    record = _made_here.get(name)
    if record is not None:
        record.take(counts, seen)
    return value
