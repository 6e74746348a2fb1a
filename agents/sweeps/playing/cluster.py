"""Doing pieces of work on Dask's workers: of this machine, or of a scheduler anywhere.

Pieces are tasks that depend on nothing. What a worker did comes back to this process, which alone
writes: no file system need be shared. A worker that is lost loses what it was doing, which Dask
does elsewhere; a scheduler that comes back gets what it had not done again.
"""

from __future__ import annotations

import pickle
import time
from collections import deque
from contextlib import ExitStack
from functools import lru_cache
from threading import Event
from typing import TYPE_CHECKING, Generic, cast

from stickslip.agents.sweeps.playing.engine import Found
from stickslip.agents.sweeps.playing.play import StoppedError
from stickslip.dynamics.checks import require_integer, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from distributed import Client, Future

    from stickslip.agents.sweeps.playing.engine import Watch, Work

AHEAD = 2
"""Pieces given out for each thread of the workers: one to do, one to go on with."""
RETRIES = 3
"""Times that a piece is done again after what went wrong in it."""
CONNECT = 30.0
"""How long a scheduler may take to answer at first [s]."""
PATIENCE = 60.0
"""How long a scheduler may be gone, or be without workers [s]."""
POLL = 0.2
"""How often `stop` is asked [s]."""


def run_beyond(
    work: Work[Found],
    todo: Sequence[int],
    watch: Watch,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    processes: bool = True,
    patience: float | None = None,
) -> None:
    """Do the pieces and keep each as it comes back.

    workers: processes to start here; scheduler: the address of one that runs; one of both.
    ValueError where nothing answers there; OSError where it is gone for longer than `patience` [s]
    (by default PATIENCE), or has no workers for so long. What is written by then stays.
    StoppedError as in `run_here`.
    """
    if (workers is None) == (scheduler is None):
        raise ValueError("workers and scheduler; accepted: one of them")
    with ExitStack() as stack:
        client = _client(stack, workers, scheduler, processes)
        _Feed(work, todo, watch, client, PATIENCE if patience is None else patience).run()


class _Feed(Generic[Found]):
    """Gives pieces out, takes what comes back, and gives out again what was lost."""

    def __init__(
        self,
        work: Work[Found],
        todo: Sequence[int],
        watch: Watch,
        client: Client,
        patience: float,
    ):
        self._work, self._watch = work, watch
        self._client, self._patience = client, patience
        self._todo = deque(todo)
        self._given: dict[Future, int] = {}
        self._content = work.sent()
        self._came, self._seen = Event(), time.monotonic()

    def run(self) -> None:
        """Until nothing is left."""
        try:
            while self._todo or self._given:
                if self._watch.stop():
                    raise StoppedError
                self._give_out()
                self._came.wait(POLL)
                self._came.clear()
                self._take()
        finally:
            if self._client.status == "running":
                self._client.cancel(list(self._given), force=True)

    def _give_out(self) -> None:
        threads = self._threads()
        if threads:
            self._seen = time.monotonic()
        elif time.monotonic() - self._seen > self._patience or self._client.status == "closed":
            raise OSError(
                f"no worker of the Dask scheduler answers any more; {len(self._todo)} of "
                f"{self._work.count} pieces are left: start it again, and go on with --resume"
            )
        while self._todo and len(self._given) < AHEAD * threads:
            index = self._todo.popleft()
            future = self._client.submit(
                play_there, self._content, self._work.digest, index, retries=RETRIES, pure=False
            )
            future.add_done_callback(lambda _: self._came.set())
            self._given[future] = index

    def _threads(self) -> int:
        """Of all workers that the scheduler knows; 0 while it does not answer."""
        if self._client.status != "running":
            return 0
        try:
            return sum(cast("dict[str, int]", self._client.nthreads()).values())
        except (OSError, TimeoutError):
            return 0

    def _take(self) -> None:
        """Keep what was done; put back what a scheduler has forgotten."""
        for future in [one for one in self._given if one.status != "pending"]:
            index = self._given.pop(future)
            if future.status == "error":
                raise _told(cast("BaseException", future.exception()))
            found = self._result(future) if future.status == "finished" else None
            if found is None:
                self._todo.appendleft(index)
                continue
            self._work.keep(index, found)
            self._watch.advance(self._work.size(index))

    def _result(self, future: Future) -> Found | None:
        """What a worker found; None where it was lost on the way."""
        from concurrent.futures import CancelledError

        try:
            return future.result(timeout=self._patience)
        except (OSError, TimeoutError, CancelledError):
            return None


def play_there(content: bytes, digest: str, index: int) -> object:
    """What comes of a piece, in a worker. What does it is kept for the next one."""
    held = _held(digest)
    if not held:
        held.append(pickle.loads(content)())
    return held[0](index)


@lru_cache(maxsize=4)
def _held(digest: str) -> list[Callable[[int], object]]:
    return []


def _client(
    stack: ExitStack, workers: int | None, scheduler: str | None, processes: bool
) -> Client:
    """A client of the workers, closed with the stack, and they with it if they are ours."""
    from distributed import Client, LocalCluster

    if scheduler is None:
        count = require_integer("workers", workers, high=4096)
        cluster = stack.enter_context(
            LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                processes=processes,
                dashboard_address="127.0.0.1:0",
                memory_limit=0,
                silence_logs=50,
            )
        )
        return stack.enter_context(Client(cluster, set_as_default=False))
    try:
        return stack.enter_context(Client(scheduler, timeout=CONNECT, set_as_default=False))
    except (OSError, TimeoutError, ValueError) as error:
        raise ValueError(
            f"no Dask scheduler answers at {shown(scheduler)} ({error or 'no answer'}); accepted: "
            "the address that `dask scheduler` prints, as tcp://127.0.0.1:8786"
        ) from error


def _told(error: BaseException) -> BaseException:
    """What went wrong in a worker, as it would have been raised here."""
    from distributed import KilledWorker

    if isinstance(error, KilledWorker):
        return OSError(
            f"a piece of work ended {RETRIES} workers, one after the other; accepted: workers with "
            "more memory, or (sweeps) a smaller --chunk in a new directory. What was written stays"
        )
    return error
