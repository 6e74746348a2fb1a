"""A process that makes runs for another one and can be killed at any time.

`serve` runs in it: pickled tasks come in on standard input, pickled messages go out on standard
output; what optimisers print goes to standard error. It ends with its input, between two runs, and
on Linux with its parent, also from within C code.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Thread
from typing import IO, TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from stickslip.agents.optimisers.report import front_merit, gap
from stickslip.agents.optimisers.runs import COUNTED, Run
from stickslip.agents.sweeps.cells import POLL, StoppedError
from stickslip.envs.rendering.extras import require
from stickslip.optim.instances.instance import instance
from stickslip.optim.instances.objective import BudgetSpent, Record
from stickslip.records.signals import ENDING

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.optimisers.methods import Method
    from stickslip.optim.instances.instance import Instance
    from stickslip.optim.instances.objective import Objective

MAKING = 900.0
"""Time limit for building and compiling an instance [s]."""
STEP = 1.0
"""Longest time that counts between two polls [s]: while this process is halted, none does."""
DIES_WITH_PARENT = 1
"""Linux's PR_SET_PDEATHSIG."""
COMPILING, LOST = "compiling", "lost"
"""A stage of a run; the message that stands for the end of the process."""
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

    evaluations: int = 0
    seconds: float = 0.0
    value: float = np.nan
    point: np.ndarray | None = None


class Worker:
    """A process for one run at a time.

    limit: time that a run, and a method's trial before its first one, may take [s]; then the
    process is killed, and the next run gets another.
    """

    def __init__(self, limit: float):
        self._limit = limit
        self._process: subprocess.Popen[bytes] | None = None
        self._messages: SimpleQueue[object] = SimpleQueue()

    def run(self, task: Task, stop: Callable[[], bool]) -> Run:
        """Make the run. StoppedError where `stop` returns True."""
        self._send(task)
        doing, events, used = COMPILING, list[Event](), 0.0
        while True:
            before, message = time.monotonic(), None
            with suppress(Empty):
                message = self._messages.get(timeout=POLL)
            used += min(time.monotonic() - before, STEP)
            allowed = MAKING if doing == COMPILING else self._limit
            if isinstance(message, Run):
                return message
            if isinstance(message, Event):
                events.append(message)
            elif message == LOST:
                why = f"its process ended with code {self.close()} in {doing}"
                return run_of(task, events, "died", why)
            elif isinstance(message, str):
                doing, used = message, 0.0
            if stop():
                self.close()
                raise StoppedError
            if used > allowed:
                self.close()
                return run_of(task, events, "timed out", f"stopped after {allowed:g} s of {doing}")

    def close(self) -> int | None:
        """Kill the process; its exit code, negative for a signal."""
        process, self._process = self._process, None
        if process is None:
            return None
        with suppress(OSError, subprocess.TimeoutExpired):
            process.wait(0.2)
        process.kill()
        code = process.wait()
        for pipe in (process.stdin, process.stdout):
            with suppress(OSError, AttributeError):
                pipe.close()  # pyright: ignore[reportOptionalMemberAccess]
        return code

    def _send(self, task: Task) -> None:
        """Send the task, to a new process where there is none."""
        if self._process is not None and self._process.poll() is not None:
            self.close()
        if self._process is None:
            paths = [str(Path(one).resolve()) if one else str(Path.cwd()) for one in sys.path]
            self._messages = SimpleQueue()
            self._process = subprocess.Popen(
                [sys.executable, "-c", f"from {__name__} import serve; serve()"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
            )
            arguments = (self._process.stdout, self._messages)
            Thread(target=_forward, args=arguments, daemon=True).start()
        content = require("cloudpickle", "a race", "sweep").dumps(task)
        with suppress(OSError):  # a process that died is noticed later
            pickle.dump(content, self._process.stdin)  # pyright: ignore[reportArgumentType]
            self._process.stdin.flush()  # pyright: ignore[reportOptionalMemberAccess]


def _forward(pipe: IO[bytes], messages: SimpleQueue[object]) -> None:
    """Pass messages on; LOST at the end."""
    try:
        with suppress(EOFError, OSError, ValueError, pickle.UnpicklingError):
            while True:
                messages.put(pickle.load(pipe))
    finally:
        messages.put(LOST)


def run_of(
    task: Task,
    events: list[Event],
    outcome: str,
    message: str = "",
    record: Record | None = None,
    digest: str = "",
) -> Run:
    """A run by its events, the last of which is its end. record: its counters, if they are known;
    without it the run has no end of its own, and its last event stands for it."""
    rows = events if record else [*events, events[-1] if events else Event()]
    return Run(
        instance=task.instance,
        method=task.method.name,
        seed=task.seed,
        outcome=outcome,
        message=message,
        inside=task.method.inside,
        counts={name: int(getattr(record, name, 0)) for name in COUNTED},
        digest=digest,
        evaluations=np.array([row.evaluations for row in rows], np.int64),
        seconds=np.array([row.seconds for row in rows], float),
        values=np.array([row.value for row in rows], float),
        point=rows[-1].point,
    )


def serve() -> None:
    """Make the runs that come in until nothing more does."""
    if sys.platform == "linux":
        import ctypes

        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(DIES_WITH_PARENT, signal.SIGKILL)
    for one in ENDING:
        signal.signal(one, signal.SIG_IGN)  # the parent decides
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)

    def send(message: object) -> None:
        pickle.dump(message, out)
        out.flush()

    with suppress(EOFError):
        while True:
            task: Task = pickle.loads(pickle.load(sys.stdin.buffer))
            send(COMPILING)
            _compile(task.instance, task.method.batch)
            send("a trial")
            _try_out(task.instance, task.method)
            send("the run")
            send(run_task(task, send))


@cache
def _compile(name: str, batch: int) -> None:
    """Compile what the objective needs."""
    one = instance(name)
    objective = one.objective()
    objective(objective.middle)
    if batch > 1:
        objective.batch(np.tile(objective.middle, (batch, 1)))
    if objective.has_slopes:
        objective.gradient(objective.middle)
        objective.jacobian(objective.middle)
    if one.flags.noisy:
        one.value(objective.middle)


_tried = set[tuple[str, str]]()


def _try_out(name: str, method: Method) -> None:
    """Run a method on an objective that is not counted, so that it compiles its programs."""
    if (name, method.name) in _tried:
        return
    _tried.add((name, method.name))
    few = TRIED + 2 * method.batch * (method.batch > 1)
    with suppress(*RAISED):  # the run itself will report it
        method.function(instance(name).objective(budget=few), 0)


@dataclass
class EventRecord(Record):
    """The counters of an objective; sends an event for each tenth of a power of ten of the gap.

    Of a noisy instance a point's value is the mean over draws of other seeds; with two goals it is
    the share of the known front's hypervolume that is missing. Time is processor time of this
    process, without that of computing these.
    """

    instance: Instance = field(kw_only=True)
    send: Callable[[Event], None] = field(kw_only=True)
    events: list[Event] = field(default_factory=list)
    last: Event = field(default_factory=Event)
    _started: float = field(default_factory=time.process_time)
    _level: float = np.inf

    @property
    def seconds(self) -> float:
        """Processor time since this was made [s]."""
        return time.process_time() - self._started

    def note(self, x: np.ndarray, values: np.ndarray, violation: float, feasible: bool) -> None:
        """Keep a point, and send an event if it is better."""
        best, front = len(self.improvements), self.front
        super().note(x, values, violation, feasible)
        if len(self.improvements) > best or self.front is not front:
            began, seconds = time.process_time(), self.seconds
            self._judge(x, float(values[0]), seconds)
            self._started += time.process_time() - began

    def end(self) -> Event:
        """The last event."""
        return self.last._replace(evaluations=self.evaluations, seconds=self.seconds)

    def _judge(self, x: np.ndarray, value: float, seconds: float) -> None:
        several = len(self.instance.goals) > 1
        if several:
            value = front_merit(self.instance, np.array([one for _, one in self.front]))
        elif self.instance.flags.noisy:
            value = float(self.instance.value(x)[0][0])
        if value >= self.last.value:
            return
        point = None if several else np.array(x)
        self.last = Event(self.evaluations, seconds, value, point)
        left = float(gap(self.instance, value))
        level = np.ceil(np.log10(max(left, LEAST_GAP)) * A_DECADE) if left > 0 else -np.inf
        if level < self._level:
            self._level = level
            self.events.append(self.last)
            self.send(self.last)


def run_task(task: Task, send: Callable[[Event], None]) -> Run:
    """Make the run, sending events on the way."""
    one = instance(task.instance)
    record = EventRecord(instance=one, send=send)
    limits = {name: getattr(task, name) for name in ("budget", "seconds", "outside", "seed")}
    outcome, message = _outcome(task, one.objective(record=record, **limits))
    return run_of(task, [*record.events, record.end()], outcome, message, record, one.digest())


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
