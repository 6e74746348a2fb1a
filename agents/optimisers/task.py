"""One run: an instance, a method and a seed, its objective compiled beforehand."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.optimisers.measures import Target, front_merit
from stickslip.agents.optimisers.results import COUNTED, Run
from stickslip.optim.instances.catalogue import instance as instance_by_id
from stickslip.optim.instances.record import BudgetSpent, Record

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Literal

    from stickslip.agents.optimisers.method import Method
    from stickslip.optim.instances.instance import Instance
    from stickslip.optim.instances.objective import Objective

TRIED = 6
"""Evaluations of a trial before the first run, besides two batches."""
MESSAGE = 200
RAISED = (Exception, SystemExit, KeyboardInterrupt)
"""Whatever an optimiser may raise; sys.exit() in it must not end the process that serves it."""
A_DECADE, LEAST_GAP = 10, 1e-8
"""Events in each power of ten of the gap; smaller gaps are one event."""


@dataclass(frozen=True)
class Task:
    """A run to be made. budget: evaluations; seconds: of processor time; outside: as an
    Objective's."""

    instance: str
    method: Method
    seed: int
    budget: int | None
    seconds: float | None
    outside: Literal["clip", "refuse"] = "clip"


class Event(NamedTuple):
    """Progress of a run. kind: "violation", "value" or "end". evaluations, seconds: by then. value:
    the merit, NaN where nothing is feasible. violation: the least so far. point: the free numbers
    of `value`; None where there are none, and of a front."""

    kind: str
    evaluations: int
    seconds: float
    value: float
    violation: float
    point: np.ndarray | None = None


class Ending(NamedTuple):
    """How a run ended: an outcome and a message, the last Event, counters, time on the clock [s],
    and the instance's digest."""

    outcome: str
    message: str
    last: Event
    counts: dict[str, int]
    wall_seconds: float
    digest: str


@dataclass
class EventRecord(Record):
    """The counters of an objective; sends an Event for each tenth of a power of ten of the gap.

    Of a noisy instance a point's merit is the mean over draws of other seeds; with two goals it is
    the share of the known front's hypervolume that is missing. Time is processor time of this
    process, without that of computing merits.
    """

    instance: Instance = field(kw_only=True)
    send: Callable[[Event], None] = field(kw_only=True)
    started: float = field(default_factory=time.process_time)
    excluded: float = 0.0
    merit: float = np.nan
    point: np.ndarray | None = None
    _level: float = np.inf

    @property
    def seconds(self) -> float:
        """Processor time since this was made [s]."""
        return time.process_time() - self.started - self.excluded

    def see(
        self, x: np.ndarray, values: np.ndarray, violation: float, feasible: bool, number: int
    ) -> None:
        """Take note of a point, and send an event."""
        best, front = len(self.improvements), self.front
        super().see(x, values, violation, feasible, number)
        better = len(self.improvements) > best or self.front is not front
        if not better and (self.improvements or self.front):
            return
        seconds, began = self.seconds, time.process_time()
        if better:
            self._judge(x, float(values[0]), number, seconds)
        else:
            self._send("violation", self.least_violation, number, seconds)
        self.excluded += time.process_time() - began

    def end(self) -> Event:
        """The last event."""
        return Event("end", self.evaluations, self.seconds, self.merit, self.violation, self.point)

    @property
    def violation(self) -> float:
        """The least violation so far; 0 where something is feasible."""
        return 0.0 if self.improvements or self.front else self.least_violation

    def _judge(self, x: np.ndarray, value: float, number: int, seconds: float) -> None:
        several = len(self.instance.goals) > 1
        if several:
            value = front_merit(self.instance, np.array([one for _, one in self.front]))
        elif self.instance.flags.noisy:
            value = float(self.instance.value(x)[0][0])
        if np.isnan(self.merit):
            self._level = np.inf  # levels of violations end here
        if not value >= self.merit:
            self.merit, self.point = value, None if several else np.array(x)
            gap = float(Target.of(self.instance).gap(value))
            self._send("value", gap, number, seconds)

    def _send(self, kind: str, gap: float, number: int, seconds: float) -> None:
        level = np.ceil(np.log10(max(gap, LEAST_GAP)) * A_DECADE) if gap > 0 else -np.inf
        if level < self._level:
            self._level = level
            self.send(Event(kind, number, seconds, self.merit, self.violation, self.point))


def prepare(task: Task) -> None:
    """Compile what the objective needs: once for each instance, method and process."""
    _prepared(task.instance, task.method.batch, task.method.slopes)


@cache
def _prepared(name: str, batch: int, slopes: bool) -> None:
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
    """Let the method compile its own programs, on an objective that is not counted."""
    _tried(task.instance, task.method, task.budget, task.outside)


@cache
def _tried(
    name: str, method: Method, budget: int | None, outside: Literal["clip", "refuse"]
) -> None:
    few = TRIED + 2 * method.batch if method.batch > 1 else TRIED
    few = few if budget is None else min(few, budget)
    objective = instance_by_id(name).objective(budget=few, outside=outside)
    with suppress(*RAISED):  # the run itself will report it
        method.run(objective, 0)


def run_task(task: Task, send: Callable[[Event], None]) -> Ending:
    """Run it, sending events on the way."""
    one = instance_by_id(task.instance)
    record = EventRecord(instance=one, send=send)
    objective = one.objective(
        budget=task.budget,
        seconds=task.seconds,
        outside=task.outside,
        seed=task.seed,
        record=record,
    )
    began = time.perf_counter()
    outcome, message = _outcome(task, objective)
    last, took = record.end(), time.perf_counter() - began
    counts = {name: int(getattr(record, name)) for name in COUNTED}
    return Ending(outcome, message, last, counts, took, one.digest())


def _outcome(task: Task, objective: Objective) -> tuple[str, str]:
    try:
        task.method.run(objective, task.seed)
    except RAISED as error:
        if _is_spent(error):
            return "spent", ""
        return "raised", " ".join(f"{type(error).__name__}: {error}".split())[:MESSAGE]
    return "ended", ""


def _is_spent(error: BaseException) -> bool:
    """Whether the end of the budget is the error, or its cause."""
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
        budget=task.budget,
        limit_seconds=task.seconds,
        counts=ending.counts,
        wall_seconds=ending.wall_seconds,
        digest=ending.digest,
        events=tuple(row.kind for row in rows),
        evaluations=np.array([row.evaluations for row in rows], np.int64),
        seconds=np.array([row.seconds for row in rows], float),
        values=np.array([row.value for row in rows], float),
        violations=np.array([row.violation for row in rows], float),
        point=ending.last.point,
    )


def no_counts() -> dict[str, int]:
    """Counters of a run of which nothing is known."""
    return dict.fromkeys(COUNTED, 0)
