"""Where a run is made: a process of its own that can be killed, and serves again while it lives."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Lock, Thread, local
from typing import IO, TYPE_CHECKING, cast

import numpy as np

from stickslip.agents.optimisers.child import receive, send
from stickslip.agents.optimisers.results import Run
from stickslip.agents.optimisers.task import COUNTS, Ending, Task
from stickslip.agents.optimisers.watched import Event
from stickslip.agents.sweeps.playing.play import StoppedError
from stickslip.envs.rendering.extras import require

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.optim.instances.exports import Foreign

MAKING = 900.0
"""How long building and compiling an instance may take [s]."""
POLL, STEP = 0.2, 1.0
"""How often `stop` is asked [s]; and the most that counts between two looks, so that the time for
which this process itself is halted does not."""
DOING = {"made": "compiling", "tried": "a trial", "run": "the run"}
"""What a process is at, by what it tells next."""
CHILD = "stickslip.agents.optimisers.child"


class Seat:
    """A process for one run at a time.

    limit: how long a run, and a method's trial before the first one, may take on the clock [s];
    then the process is killed, and the next run gets another.
    """

    def __init__(self, limit: float):
        self._limit = limit
        self._process: subprocess.Popen[bytes] | None = None
        self._told: SimpleQueue[tuple[str, Foreign] | None] = SimpleQueue()

    def run(self, task: Task, stop: Callable[[], bool] = lambda: False) -> Run:
        """The run; StoppedError where `stop` says so."""
        self._begin(task)
        events: list[Event] = []
        at, limit, used, began = "made", MAKING, 0.0, time.monotonic()
        while True:
            before = time.monotonic()
            try:
                told = self._told.get(timeout=POLL)
            except Empty:
                told = ("wait", None)
            used += min(time.monotonic() - before, STEP)
            if told is None:
                return self._lost(task, events, DOING[at], time.monotonic() - began)
            kind, content = told[0], cast("Foreign", told[1])
            if kind == "event":
                events.append(content)
            elif kind == "end":
                return run_of(task, events, content)
            elif kind != "wait":
                at, limit, used = {"made": "tried", "tried": "run"}[kind], self._limit, 0.0
            if stop():
                self.close()
                raise StoppedError
            if used > limit:
                self.close()
                why = f"stopped after {limit:g} s of {DOING[at]}"
                return _unended(task, events, "timed out", why, time.monotonic() - began)

    def close(self) -> None:
        """Kill the process."""
        if self._process is not None:
            with suppress(OSError):
                self._process.kill()
            self._process.wait()
            for pipe in (self._process.stdin, self._process.stdout):
                if pipe is not None:
                    with suppress(OSError):
                        pipe.close()
            self._process = None

    def _begin(self, task: Task) -> None:
        """Send the task, to a new process where there is none."""
        content = require("cloudpickle", "a race", "sweep").dumps(task)
        if self._process is not None and self._process.poll() is not None:
            self.close()
        if self._process is None:
            self._told = SimpleQueue()
            self._process = subprocess.Popen(
                [sys.executable, "-m", CHILD],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env=os.environ | {"PYTHONPATH": os.pathsep.join(_paths())},
            )
            Thread(target=_listen, args=(self._process.stdout, self._told), daemon=True).start()
        if self._process.stdin is not None:
            with suppress(OSError):  # it has died: that will be told
                send(self._process.stdin, content)

    def _lost(self, task: Task, events: list[Event], doing: str, took: float) -> Run:
        code = self._process.wait() if self._process is not None else None
        self.close()
        words = (
            f"its process ended with code {code}"
            if code is None or code >= 0
            else (f"its process was ended by signal {-code}")
        )
        return _unended(task, events, "died", f"{words} in {doing}", took)


class Seats:
    """A Seat for each thread that asks."""

    def __init__(self, limit: float):
        self._limit, self._own = limit, local()
        self._all, self._lock = list[Seat](), Lock()

    def here(self) -> Seat:
        """This thread's."""
        if not hasattr(self._own, "seat"):
            self._own.seat = Seat(self._limit)
            with self._lock:
                self._all.append(self._own.seat)
        return self._own.seat

    def close(self) -> None:
        """End the processes."""
        for seat in self._all:
            seat.close()


def run_of(task: Task, events: list[Event], ending: Ending) -> Run:
    """A run from what was told of it."""
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


def _unended(task: Task, events: list[Event], outcome: str, why: str, took: float) -> Run:
    """A run that told of no end: what is known is the last that it told."""
    last = events[-1] if events else Event("end", 0, 0.0, np.nan, np.inf)
    counts = {str(name): 0 for name in COUNTS}
    return run_of(task, events, Ending(outcome, why, last._replace(kind="end"), counts, took, ""))


def _listen(pipe: IO[bytes] | None, told: SimpleQueue[tuple[str, Foreign] | None]) -> None:
    """Pass on what a process tells; None at its end."""
    with suppress(OSError, ValueError):
        while pipe is not None and (content := receive(pipe)) is not None:
            told.put(pickle.loads(content))
    told.put(None)


def _paths() -> list[str]:
    """Where this process finds modules, for another one."""
    return [str(Path(one).resolve()) if one else str(Path.cwd()) for one in sys.path]
