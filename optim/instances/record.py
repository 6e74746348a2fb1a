"""Record of an optimiser's evaluations of an objective."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stickslip.dynamics.numeric import read_only
from stickslip.optim.instances.reports import reporting, settle

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stickslip.optim.instances.reports import Home, Seen


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
