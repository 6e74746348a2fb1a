"""A process that makes runs for another one and can be killed at any time.

`python -m` this module serves: pickled tasks come in on standard input, pickled messages go out on
standard output; what optimisers print goes to standard error. It ends with its input or, on Linux,
with its parent, also from within C code.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Thread
from typing import IO, TYPE_CHECKING

from stickslip.agents.optimisers.runs import COUNTED
from stickslip.agents.optimisers.task import (
    Ending,
    Event,
    Task,
    prepare,
    run_of,
    run_task,
    try_out,
)
from stickslip.agents.sweeps.cells import POLL, StoppedError
from stickslip.envs.rendering.extras import require
from stickslip.records.signals import ENDING

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.optimisers.runs import Run

MAKING = 900.0
"""Time limit for building and compiling an instance [s]."""
STEP = 1.0
"""Longest time that counts between two polls [s]: while this process is halted, none does."""
DIES_WITH_PARENT = 1
"""Linux's PR_SET_PDEATHSIG."""
NEXT, LOST = "next", "lost"


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
        stages = iter((("compiling", MAKING), ("a trial", self._limit), ("the run", self._limit)))
        doing, allowed = next(stages)
        events, used = list[Event](), 0.0
        while True:
            before = time.monotonic()
            try:
                message = self._messages.get(timeout=POLL)
            except Empty:
                message = None
            used += min(time.monotonic() - before, STEP)
            if isinstance(message, Event):
                events.append(message)
            elif isinstance(message, Ending):
                return run_of(task, events, message)
            elif message == NEXT:
                (doing, allowed), used = next(stages), 0.0
            elif message == LOST:
                why = f"its process ended with code {self.close()} in {doing}"
                return _failed(task, events, "died", why)
            if stop():
                self.close()
                raise StoppedError
            if used > allowed:
                self.close()
                return _failed(task, events, "timed out", f"stopped after {allowed:g} s of {doing}")

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
                [sys.executable, "-m", "stickslip.agents.optimisers.worker"],
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


def _failed(task: Task, events: list[Event], outcome: str, why: str) -> Run:
    """A run without an end: its last event is what is known."""
    last = events[-1] if events else Event(0, 0.0, float("nan"))
    return run_of(task, events, Ending(outcome, why, last, dict.fromkeys(COUNTED, 0), ""))


def _forward(pipe: IO[bytes], messages: SimpleQueue[object]) -> None:
    """Pass messages on; LOST at the end."""
    try:
        with suppress(EOFError, OSError, ValueError, pickle.UnpicklingError):
            while True:
                messages.put(pickle.load(pipe))
    finally:
        messages.put(LOST)


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
    tasks: SimpleQueue[bytes] = SimpleQueue()
    Thread(target=_listen, args=(tasks,), daemon=True).start()

    def send(message: object) -> None:
        pickle.dump(message, out)
        out.flush()

    tried = set()
    while True:
        task: Task = pickle.loads(tasks.get())
        prepare(task.instance, task.method.batch, task.method.slopes)
        send(NEXT)
        if (kind := (task.instance, task.method.name)) not in tried:
            try_out(task)
            tried.add(kind)
        send(NEXT)
        send(run_task(task, send))


def _listen(tasks: SimpleQueue[bytes]) -> None:
    """Take tasks; end the process where there are no more."""
    with suppress(EOFError, OSError, pickle.UnpicklingError):
        while True:
            tasks.put(pickle.load(sys.stdin.buffer))
    os._exit(0)


if __name__ == "__main__":
    serve()
