"""Doing numbered pieces of work that depend on nothing, in this process: every core or device."""

from __future__ import annotations

from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from dataclasses import dataclass
from itertools import count
from queue import Empty, SimpleQueue
from threading import Event
from typing import TYPE_CHECKING, Protocol, TypeVar

import jax

from stickslip.agents.sweeps.playing.play import StoppedError
from stickslip.dynamics.checks import require_integer
from stickslip.envs.collecting import cores_here

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from jaxtyping import PyTree

Found = TypeVar("Found")
POLL = 0.2
"""How often `stop` is asked [s]."""


@dataclass(frozen=True)
class Watch:
    """Who is told of what. advance: of what was done. stop: whether to end before the end."""

    advance: Callable[[int], None] = lambda count: None
    stop: Callable[[], bool] = lambda: False


class Work(Protocol[Found]):
    """Pieces by number, done anywhere in any order, and kept by one process.

    digest: of what decides all of them. count: how many there are.
    """

    @property
    def digest(self) -> str:
        """See above."""
        ...

    @property
    def count(self) -> int:
        """See above."""
        ...

    def size(self, index: int) -> int:
        """What a piece counts for in the progress."""
        ...

    def play(
        self,
        index: int,
        device: PyTree,
        advance: Callable[[int], None],
        stop: Callable[[], bool],
    ) -> Found:
        """Do a piece, in one of several threads; StoppedError where `stop` says so."""
        ...

    def keep(self, index: int, found: Found) -> None:
        """Write what came of it, whole or not at all."""
        ...

    def sent(self) -> bytes:
        """What other processes are sent: pickled, what makes the function from index to Found."""
        ...


def threads_of(cores: int | None) -> int:
    """Chunks that are played at once: one for each core or, where there are several devices or they
    are no processors, for each device of this process."""
    if cores is not None:
        return require_integer("cores", cores, high=4096)
    return len(devices_here()) or cores_here()


def devices_here() -> list[PyTree]:
    """The devices that chunks are laid on in turn; none where the one processor's cores do it."""
    found = jax.local_devices()
    return found if len(found) > 1 or jax.default_backend() != "cpu" else []


def run_here(work: Work[Found], todo: Sequence[int], threads: int, watch: Watch) -> None:
    """Do the pieces and keep each as it is done.

    A thread keeps to a device and takes the next piece that nobody has. What fails in one ends the
    others at their next look at `stop`, and is raised; what is kept stays. StoppedError where
    `watch.stop` says so.
    """
    waiting, ended = SimpleQueue[int](), Event()
    for index in todo:
        waiting.put(index)
    devices, turn = devices_here() or [None], count()

    def take() -> None:
        device = devices[next(turn) % len(devices)]
        while not ended.is_set():
            try:
                index = waiting.get_nowait()
            except Empty:
                return
            work.keep(index, work.play(index, device, watch.advance, ended.is_set))

    with ThreadPoolExecutor(min(threads, max(1, len(todo)))) as pool:
        running = {pool.submit(take) for _ in range(min(threads, len(todo)))}
        try:
            while running:
                done, running = wait(running, POLL, FIRST_EXCEPTION)
                for one in done:
                    one.result()
                if watch.stop():
                    raise StoppedError
        finally:
            ended.set()
