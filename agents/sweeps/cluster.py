"""Playing the chunks of a sweep on Dask's workers: of this machine, or of a scheduler anywhere.

Chunks are tasks that depend on nothing. What a worker played comes back to this process, which
alone writes: no file system need be shared. A worker that is lost loses what it was playing, which
Dask plays elsewhere; a scheduler that comes back gets what it had not done again.
"""

from __future__ import annotations

import pickle
import time
from collections import deque
from contextlib import ExitStack
from functools import lru_cache
from threading import Event
from typing import TYPE_CHECKING, cast

from stickslip.agents.sweeps.engine import keep_chunk
from stickslip.agents.sweeps.play import Player, StoppedError
from stickslip.dynamics.checks import require_integer, shown

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import numpy as np
    from distributed import Client, Future

    from stickslip.agents.sweeps.engine import Watch
    from stickslip.agents.sweeps.plan import Plan

AHEAD = 2
"""Chunks given out for each thread of the workers: one to play, one to go on with."""
RETRIES = 3
"""Times that a chunk is played again after what went wrong in it."""
CONNECT = 30.0
"""How long a scheduler may take to answer at first [s]."""
PATIENCE = 60.0
"""How long a scheduler may be gone, or be without workers [s]."""
POLL = 0.2
"""How often `stop` is asked [s]."""


def run_beyond(
    plan: Plan,
    path: Path,
    todo: Sequence[int],
    watch: Watch,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    processes: bool = True,
    patience: float | None = None,
) -> None:
    """Play the chunks and write each as it comes back.

    workers: processes to start here; scheduler: the address of one that runs; one of both.
    ValueError where nothing answers there; OSError where it is gone for longer than `patience` [s]
    (by default PATIENCE), or has no workers for so long. What is written by then stays.
    StoppedError as in `run_here`.
    """
    if (workers is None) == (scheduler is None):
        raise ValueError("workers and scheduler; accepted: one of them")
    with ExitStack() as stack:
        client = _client(stack, workers, scheduler, processes)
        _Feed(plan, path, todo, watch, client, PATIENCE if patience is None else patience).run()


class _Feed:
    """Gives chunks out, takes what comes back, and gives out again what was lost."""

    def __init__(
        self,
        plan: Plan,
        path: Path,
        todo: Sequence[int],
        watch: Watch,
        client: Client,
        patience: float,
    ):
        self._plan, self._path, self._watch = plan, path, watch
        self._client, self._patience = client, patience
        self._todo = deque(todo)
        self._given: dict[Future, int] = {}
        self._content = pickle.dumps(plan)
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
                f"{len(self._plan.chunks)} chunks are left: start it again, and go on with --resume"
            )
        while self._todo and len(self._given) < AHEAD * threads:
            index = self._todo.popleft()
            future = self._client.submit(
                play_there, self._content, self._plan.digest, index, retries=RETRIES, pure=False
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
        """Write what was played; put back what a scheduler has forgotten."""
        for future in [one for one in self._given if one.status != "pending"]:
            index = self._given.pop(future)
            if future.status == "error":
                raise _told(cast("BaseException", future.exception()))
            columns = self._result(future) if future.status == "finished" else None
            if columns is None:
                self._todo.appendleft(index)
                continue
            keep_chunk(self._plan, self._path, index, columns)
            chunk = self._plan.chunks[index]
            self._watch.advance((chunk.last - chunk.first) * self._plan.episodes)

    def _result(self, future: Future) -> dict[str, np.ndarray] | None:
        """What a worker played; None where it was lost on the way."""
        from concurrent.futures import CancelledError

        try:
            return future.result(timeout=self._patience)
        except (OSError, TimeoutError, CancelledError):
            return None


def play_there(content: bytes, digest: str, index: int) -> dict[str, np.ndarray]:
    """A chunk's columns, in a worker. Its programs are kept for the next chunk."""
    player = _player(digest, content)
    return player.play(player.plan.chunks[index])


@lru_cache(maxsize=4)
def _player_of(digest: str) -> list[Player]:
    return []


def _player(digest: str, content: bytes) -> Player:
    held = _player_of(digest)
    if not held:
        held.append(Player(pickle.loads(content)))
    return held[0]


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
            f"a chunk ended {RETRIES} workers, one after the other; accepted: workers with more "
            "memory, or a smaller --chunk in a new directory. What was written stays"
        )
    return error
