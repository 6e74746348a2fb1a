"""One run of an optimiser, in a process of its own that measures its processor time."""

import multiprocessing
import os
import pickle
import signal
import time
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from threading import Thread
from typing import NamedTuple

import numpy as np

from stickslip.agents.optimisers.methods import Method
from stickslip.agents.optimisers.report import COUNTED, Run, gap
from stickslip.optim.instances.instance import Instance, instance
from stickslip.optim.instances.objective import Objective, Record
from stickslip.records.signals import ENDING

TRIED = 6
"""Evaluations of a trial before the first run, or two batches."""
RAISED = (Exception, SystemExit, KeyboardInterrupt)
"""Exceptions of an optimiser; sys.exit() in it must not end the process that runs it."""
A_DECADE, LEAST_GAP = 10, 1e-8
"""Events in each power of ten of the gap; smaller gaps are one event."""


@dataclass(frozen=True)
class Task:
    """A run to be made. budget: evaluations; seconds: of processor time."""

    instance: str
    method: Method
    seed: int
    budget: int | None
    seconds: float | None


def begin_worker() -> None:
    """Prepare a process for runs: what optimisers print goes to standard error, the parent decides
    about signals, and the process ends with its parent, as does what optimisers fork from it."""
    os.dup2(2, 1)
    for one in ENDING:
        signal.signal(one, signal.SIG_IGN)
    _watch_parent()
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=_watch_parent)


def _watch_parent() -> None:
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    if (parent := multiprocessing.parent_process()) is not None:
        parent.join()
        os._exit(1)


_tried = set[tuple[str, str]]()


def make_run(content: bytes) -> Run:
    """Make the run of a pickled Task, after all that it needs was compiled."""
    task: Task = pickle.loads(content)
    name, method = task.instance, task.method
    _compile(name)
    if (name, method.name) not in _tried:  # so that the method compiles its own, counted nowhere
        _tried.add((name, method.name))
        one = instance(name)
        given = {"problems": one.problems, "noisy": one.flags.noisy, "budget": task.budget}
        with suppress(*RAISED):  # the run itself will report it
            _minimise(method, _Trial(**given, record=_Calls()), 0)
    return run_task(task)


class _Calls(Record):
    """Counts a batch as half a trial, whatever its size."""

    def count(self, name: str, by: int = 1) -> None:
        super().count(name, min(by, TRIED // 2))


class _Trial(Objective):
    """Compiles batches as large as the run will have them; ends after TRIED calls."""

    def _left(self, wanted: int) -> int:
        if self.record.evaluations >= TRIED:
            raise self._spent()
        return wanted if self.budget is None else min(wanted, self.budget)


def _minimise(method: Method, objective: Objective, seed: int) -> None:
    """Run an optimiser. A process that it forks ends here: the worker's other tasks are not its."""
    worker = os.getpid()
    try:
        method.function(objective, seed)
    finally:
        if os.getpid() != worker:
            os._exit(1)


@cache
def _compile(name: str) -> None:
    """Compile what the objective needs."""
    one = instance(name)
    objective = one.objective()
    objective(objective.middle)
    if objective.has_slopes:
        objective.gradient(objective.middle)
        objective.jacobian(objective.middle)
    if one.flags.noisy:
        one.value(objective.middle)


class Event(NamedTuple):
    """Progress of a run. evaluations, seconds: so far. value: NaN where nothing is feasible.
    point: the free numbers of `value`; None where there are none."""

    evaluations: int = 0
    seconds: float = 0.0
    value: float = np.nan
    point: np.ndarray | None = None


@dataclass
class EventRecord(Record):
    """The counters of an objective, and an event for each tenth of a power of ten of the gap.

    Of a noisy instance a point's value is the mean over draws of other seeds. Time is processor
    time of this process, without that of computing these.
    """

    instance: Instance = field(kw_only=True)
    events: list[Event] = field(default_factory=list)
    last: Event = field(default_factory=Event)
    _started: float = field(default_factory=time.process_time)
    _level: float = np.inf

    @property
    def seconds(self) -> float:
        """Processor time since this was made [s]."""
        return time.process_time() - self._started

    def note(self, x: np.ndarray, values: np.ndarray, feasible: bool) -> None:
        """Keep a point, and note an event if it is better."""
        best = len(self.improvements)
        super().note(x, values, feasible)
        if len(self.improvements) > best:
            began, seconds = time.process_time(), self.seconds
            self._judge(x, float(values[0]), seconds)
            self._started += time.process_time() - began

    def end(self) -> Event:
        """The last event."""
        return self.last._replace(evaluations=self.evaluations, seconds=self.seconds)

    def _judge(self, x: np.ndarray, value: float, seconds: float) -> None:
        if self.instance.flags.noisy:
            value = float(self.instance.value(x)[0][0])
        if value >= self.last.value:
            return
        self.last = Event(self.evaluations, seconds, value, np.array(x))
        left = float(gap(self.instance, value))
        level = np.ceil(np.log10(max(left, LEAST_GAP)) * A_DECADE) if left > 0 else -np.inf
        if level < self._level or not np.isfinite(left):  # where no value is known, all are kept
            self._level = level
            self.events.append(self.last)


def run_task(task: Task) -> Run:
    """Make the run."""
    one = instance(task.instance)
    record = EventRecord(instance=one)
    limits = {name: getattr(task, name) for name in ("budget", "seconds", "seed")}
    outcome, message = "ended", ""
    try:
        _minimise(task.method, one.objective(record=record, **limits), task.seed)
    except RAISED as error:
        outcome, message = "raised", " ".join(f"{type(error).__name__}: {error}".split())
        most, longest = task.budget or np.inf, task.seconds or np.inf
        if record.evaluations >= most or record.seconds >= longest:  # what it raises is its end
            outcome, message = "spent", ""
    return run_of(task, outcome, message, record)


def run_of(task: Task, outcome: str, message: str, record: EventRecord | None = None) -> Run:
    """A run; without a record, that of a process that was killed, or ended: no value, counts 0."""
    events = [Event()] if record is None else [*record.events, record.end()]
    return Run(
        instance=task.instance,
        method=task.method.name,
        seed=task.seed,
        outcome=outcome,
        message=message[:200],
        inside=task.method.inside,
        counts={name: int(getattr(record, name, 0)) for name in COUNTED},
        digest=instance(task.instance).digest(),
        evaluations=np.array([one.evaluations for one in events], np.int64),
        seconds=np.array([one.seconds for one in events], float),
        values=np.array([one.value for one in events], float),
        point=events[-1].point,
    )
