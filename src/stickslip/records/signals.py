"""Requests to end: Ctrl-C, SIGTERM (Slurm, Docker, kill) and SIGHUP (a terminal that is closed)."""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, NoReturn

ENDING = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)


class Interrupted(KeyboardInterrupt):
    """A signal ended the work. status: the exit status that shells expect, 128 + its number."""

    def __init__(self, number: int, message: str = ""):
        default = f"interrupted by {signal.Signals(number).name}; the same command begins anew"
        super().__init__(message or default)
        self.number, self.status = number, 128 + number


def interrupt(number: int, frame: FrameType | None = None) -> NoReturn:
    """Handle a signal by ending at once."""
    raise Interrupted(number)


@contextmanager
def handled(handler: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    """Inside, the signals of ENDING call the handler, but for those that are ignored (nohup)."""
    here = threading.current_thread() is threading.main_thread()
    asked = [one for one in ENDING if here and signal.getsignal(one) != signal.SIG_IGN]
    before = {one: signal.signal(one, handler) for one in asked}
    try:
        yield
    finally:
        for one, old in before.items():
            signal.signal(one, old)


@contextmanager
def interruptible() -> Iterator[None]:
    """Inside, a signal of ENDING raises Interrupted, again if a finaliser or callback drops it."""

    def dropped(found: Any) -> None:
        if isinstance(found.exc_value, Interrupted):
            threading.Timer(0.1, os.kill, (os.getpid(), found.exc_value.number)).start()
        else:
            before(found)

    before, sys.unraisablehook = sys.unraisablehook, dropped
    try:
        with handled(interrupt):
            yield
    finally:
        sys.unraisablehook = before


class Stop:
    """Stop request, set by the first signal, read at each step of the work.

    A second Ctrl-C ends it at once; SIGTERM and SIGHUP may come twice (from kernel and shell).
    """

    def __init__(self) -> None:
        self.number = 0

    def __call__(self) -> bool:
        return self.number != 0

    def ask(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal."""
        if self.number and number == signal.SIGINT:
            interrupt(number)
        if not self.number:
            self.number = number
            complain("\nStopping at the next step; Ctrl-C again stops at once.")

    def interrupted(self, message: str) -> Interrupted:
        """The exception that ends the command with the message, which says how to go on."""
        return Interrupted(self.number or signal.SIGINT, message)


class StoppedError(Exception):
    """The work was asked to stop."""


@contextmanager
def stoppable(message: str = "") -> Iterator[Stop]:
    """Inside, a signal of ENDING asks the work to stop. Where it does by a StoppedError, it was
    interrupted, with the message."""
    stop = Stop()
    with handled(stop.ask):
        try:
            yield stop
        except StoppedError:
            raise stop.interrupted(message) from None


def complain(line: str) -> None:
    """Print a line on standard error; where the terminal is gone, no output goes there any more."""
    try:
        print(line, file=sys.stderr, flush=True)
    except OSError:
        discard_output("stdout", "stderr")


def discard_output(*names: str) -> None:
    """Let streams of `sys`, and what they still hold, lead nowhere: who read them has left."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for name in names:
        try:
            os.dup2(nowhere, getattr(sys, name).fileno())
        except (OSError, ValueError):  # a stream in memory, or closed
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
    with suppress(OSError):
        os.close(nowhere)
