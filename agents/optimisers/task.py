"""One run of an optimiser: an instance, a method and a seed, its objective compiled beforehand."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.optimisers.report import Target, front_merit
from stickslip.agents.optimisers.runs import COUNTED, Run
from stickslip.optim.instances.catalogue import instance as instance_by_id
from stickslip.optim.instances.record import BudgetSpent, Record

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Literal

    from stickslip.agents.optimisers.methods import Method
    from stickslip.optim.instances.instance import Instance
    from stickslip.optim.instances.objective import Objective

TRIED = 6
"""Evaluations of a trial before the first run, besides two batches."""
MESSAGE = 200
RAISED = (Exception, SystemExit, KeyboardInterrupt)
"""Exceptions of an optimiser; sys.exit() in it must not end the process that serves it."""
A_DECADE, LEAST_GAP = 10, 1e-8
"""Events in each power of ten of the gap; smaller gaps are one event."""


@dataclass(frozen=True)
class Task:
    """A run to be made. budget: evaluations; seconds: of processor time; outside: see Objective."""

    instance: str
    method: Method
    seed: int
    budget: int | None
    seconds: float | None
    outside: Literal["clip", "refuse"] = "clip"


class Event(NamedTuple):
    """Progress of a run. evaluations, seconds: so far. value: NaN where nothing is feasible.
    point: the free numbers of `value`; None where there are none, and of a front."""

    evaluations: int
    seconds: float
    value: float
    point: np.ndarray | None = None


class Ending(NamedTuple):
    """End of a run: an outcome and a message, the last event, counters, the instance's digest."""

    outcome: str
    message: str
    last: Event
    counts: dict[str, int]
    digest: str


@dataclass
class EventRecord(Record):
    """The counters of an objective; sends an event for each tenth of a power of ten of the gap.

    Of a noisy instance a point's value is the mean over draws of other seeds; with two goals it is
    the share of the known front's hypervolume that is missing. Time is processor time of this
    process, without that of computing these.
    """

    instance: Instance = field(kw_only=True)
    send: Callable[[Event], None] = field(kw_only=True)
    started: float = field(default_factory=time.process_time)
    excluded: float = 0.0
    value: float = np.nan
    point: np.ndarray | None = None
    _level: float = np.inf

    @property
    def seconds(self) -> float:
        """Processor time since this was made [s]."""
        return time.process_time() - self.started - self.excluded

    def see(
        self, x: np.ndarray, values: np.ndarray, violation: float, feasible: bool, number: int
    ) -> None:
        """Keep a point, and send an event if it is better."""
        best, front = len(self.improvements), self.front
        super().see(x, values, violation, feasible, number)
        if len(self.improvements) > best or self.front is not front:
            seconds, began = self.seconds, time.process_time()
            self._judge(x, float(values[0]), number, seconds)
            self.excluded += time.process_time() - began

    def end(self) -> Event:
        """The last event."""
        return Event(self.evaluations, self.seconds, self.value, self.point)

    def _judge(self, x: np.ndarray, value: float, number: int, seconds: float) -> None:
        several = len(self.instance.goals) > 1
        if several:
            value = front_merit(self.instance, np.array([one for _, one in self.front]))
        elif self.instance.flags.noisy:
            value = float(self.instance.value(x)[0][0])
        if value >= self.value:
            return
        self.value, self.point = value, None if several else np.array(x)
        gap = float(Target.of(self.instance).gap(value))
        level = np.ceil(np.log10(max(gap, LEAST_GAP)) * A_DECADE) if gap > 0 else -np.inf
        if level < self._level:
            self._level = level
            self.send(Event(number, seconds, value, self.point))


@cache
def prepare(name: str, batch: int, slopes: bool) -> None:
    """Compile what the objective needs: once for each instance, method and process."""
    one = instance_by_id(name)
    objective = one.objective()
    objective(objective.middle)
    if batch > 1:
        objective.batch(np.tile(objective.middle, (batch, 1)))
    if slopes or objective.has_slopes:
        objective.gradient(objective.middle)
        objective.jacobian(objective.middle)
    if one.flags.noisy:
        one.value(objective.middle)


def try_out(task: Task) -> None:
    """Run the method on an objective that is not counted, so that it compiles its programs."""
    few = TRIED + 2 * task.method.batch if task.method.batch > 1 else TRIED
    few = few if task.budget is None else min(few, task.budget)
    objective = instance_by_id(task.instance).objective(budget=few, outside=task.outside)
    with suppress(*RAISED):  # the run itself will report it
        task.method.function(objective, 0)


def run_task(task: Task, send: Callable[[Event], None]) -> Ending:
    """Make the run, sending events on the way."""
    one = instance_by_id(task.instance)
    record = EventRecord(instance=one, send=send)
    objective = one.objective(
        budget=task.budget,
        seconds=task.seconds,
        outside=task.outside,
        seed=task.seed,
        record=record,
    )
    outcome, message = _outcome(task, objective)
    counts = {name: int(getattr(record, name)) for name in COUNTED}
    return Ending(outcome, message, record.end(), counts, one.digest())


def _outcome(task: Task, objective: Objective) -> tuple[str, str]:
    try:
        task.method.function(objective, task.seed)
    except RAISED as error:
        if _is_spent(error):
            return "spent", ""
        return "raised", " ".join(f"{type(error).__name__}: {error}".split())[:MESSAGE]
    return "ended", ""


def _is_spent(error: BaseException) -> bool:
    """True if the end of the budget is the error, or its cause."""
    seen: list[BaseException] = []
    while error not in seen:
        if isinstance(error, BudgetSpent):
            return True
        seen.append(error)
        error = error.__cause__ or error.__context__ or error
    return False


def run_of(task: Task, events: list[Event], ending: Ending) -> Run:
    """A run from its events and its ending."""
    rows = [*events, ending.last]
    return Run(
        instance=task.instance,
        method=task.method.name,
        seed=task.seed,
        outcome=ending.outcome,
        message=ending.message,
        inside=task.method.inside,
        counts=ending.counts,
        digest=ending.digest,
        evaluations=np.array([row.evaluations for row in rows], np.int64),
        seconds=np.array([row.seconds for row in rows], float),
        values=np.array([row.value for row in rows], float),
        point=ending.last.point,
    )
