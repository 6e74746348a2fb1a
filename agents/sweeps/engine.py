"""Independent cells of work, numbered: on threads of this process or on Dask's workers.

What is computed anywhere comes back to the process that called, which alone writes. Used by sweeps
and by races of optimisers.
"""

from __future__ import annotations

import pickle
import time
from collections import deque
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from contextlib import ExitStack
from functools import lru_cache
from threading import Event
from typing import TYPE_CHECKING, TypeVar, cast

import jax

from stickslip.dynamics.checks import require_integer, shown
from stickslip.envs.collecting import cores_here

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from distributed import Client, Future
    from jaxtyping import PyTree

    Stop = Callable[[], bool]

Found = TypeVar("Found")
POLL = 0.2
"""How often `stop` is asked [s]."""
AHEAD, RETRIES = 2, 3
"""Cells submitted for each thread of the workers; repetitions of a cell whose worker failed."""
CONNECT, PATIENCE = 30.0, 60.0
"""How long a scheduler may take to answer, and be gone or without workers [s]."""


class StoppedError(Exception):
    """The work was asked to stop."""


def threads_of(cores: int | None) -> int:
    """Cells at once: as asked for, or one for each device where there are several, or core."""
    if cores is not None:
        return require_integer("cores", cores, high=4096)
    return len(_devices()) or cores_here()


def _devices() -> list[PyTree]:
    """Devices that share the cells; none where the one CPU device uses all cores."""
    found = jax.local_devices()
    return found if len(found) > 1 or jax.default_backend() != "cpu" else []


def run_threads(
    play: Callable[[int, PyTree, Stop], Found],
    keep: Callable[[int, Found], None],
    todo: Sequence[int],
    *,
    threads: int,
    stop: Stop,
) -> None:
    """Play the cells and keep each as it is done.

    An error in one ends the others at their next look at `stop`, and is raised; what is kept
    stays. StoppedError where `stop` says so.
    """
    waiting, ended = deque(todo), Event()
    devices = _devices() or [None]

    def work(device: PyTree) -> None:
        while not ended.is_set():
            try:
                number = waiting.popleft()
            except IndexError:
                return
            keep(number, play(number, device, ended.is_set))

    count = max(1, min(threads, len(todo)))
    with ThreadPoolExecutor(count) as pool:
        running = {pool.submit(work, devices[i % len(devices)]) for i in range(count)}
        try:
            while running:
                done, running = wait(running, POLL, FIRST_EXCEPTION)
                for one in done:
                    one.result()
                if stop():
                    raise StoppedError
        finally:
            ended.set()


def run_dask(
    content: bytes,
    keep: Callable[[int, Found], None],
    todo: Sequence[int],
    *,
    stop: Stop,
    workers: int | None = None,
    scheduler: str | None = None,
    processes: bool = True,
) -> None:
    """Play the cells on Dask's workers and keep each as it comes back.

    content: pickle of what makes the function of a cell's number. workers: processes to start here;
    scheduler: the address of one that runs. A cell of a lost worker is played by another. OSError
    where no worker answers for PATIENCE; ValueError where no scheduler does at first.
    """
    with ExitStack() as stack:
        client = _client(stack, workers, scheduler, processes)
        given: dict[Future, int] = {}
        waiting, came = deque(todo), Event()
        seen = time.monotonic()
        try:
            while waiting or given:
                if stop():
                    raise StoppedError
                threads = _threads(client)
                seen = time.monotonic() if threads else seen
                if time.monotonic() - seen > PATIENCE or client.status == "closed":
                    left = len(waiting) + len(given)
                    raise OSError(
                        f"no worker of the Dask scheduler answers; {left} cells are left: start it "
                        "again, and continue with --resume"
                    )
                while waiting and len(given) < AHEAD * threads:
                    number = waiting.popleft()
                    task = client.submit(_play, content, number, retries=RETRIES, pure=False)
                    task.add_done_callback(lambda _: came.set())
                    given[task] = number
                came.wait(POLL)
                came.clear()
                for task in [one for one in given if one.status != "pending"]:
                    number = given.pop(task)
                    if (found := _result(task)) is None:
                        waiting.appendleft(number)  # lost with its scheduler
                    else:
                        keep(number, cast("Found", found[0]))
        finally:
            if client.status == "running":
                client.cancel(list(given), force=True)


def _play(content: bytes, number: int) -> object:
    """Play a cell in a worker."""
    return _loaded(content)(number)


@lru_cache(maxsize=4)
def _loaded(content: bytes) -> Callable[[int], object]:
    return pickle.loads(content)()


def _threads(client: Client) -> int:
    """Threads of all workers that the scheduler knows; 0 while it does not answer."""
    if client.status != "running":
        return 0
    try:
        return sum(cast("dict[str, int]", client.nthreads()).values())
    except (OSError, TimeoutError):
        return 0


def _result(task: Future) -> tuple[object] | None:
    """What a worker returned, or None where it was lost; raise what it raised."""
    from concurrent.futures import CancelledError

    from distributed import KilledWorker

    if task.status == "error":
        error = cast("BaseException", task.exception())
        if isinstance(error, KilledWorker):
            raise OSError(
                f"a cell ended {RETRIES} workers, one after the other; accepted: workers with more "
                "memory. What was written stays"
            ) from error
        raise error
    try:
        return (task.result(timeout=PATIENCE),) if task.status == "finished" else None
    except (OSError, TimeoutError, CancelledError):
        return None


def _client(
    stack: ExitStack, workers: int | None, scheduler: str | None, processes: bool
) -> Client:
    """Connect to the workers; the stack closes the client, and the workers that it started."""
    from distributed import Client, LocalCluster

    if (workers is None) == (scheduler is None):
        raise ValueError("workers and scheduler; accepted: one of them")
    if scheduler is None:
        cluster = LocalCluster(
            n_workers=require_integer("workers", workers, high=4096),
            threads_per_worker=1,
            processes=processes,
            dashboard_address="127.0.0.1:0",
            memory_limit=0,
            silence_logs=50,
        )
        stack.enter_context(cluster)
        return stack.enter_context(Client(cluster, set_as_default=False))
    try:
        return stack.enter_context(Client(scheduler, timeout=CONNECT, set_as_default=False))
    except (OSError, TimeoutError, ValueError) as error:
        raise ValueError(
            f"no Dask scheduler answers at {shown(scheduler)} ({error or 'no answer'}); accepted: "
            "the address that `dask scheduler` prints, as tcp://127.0.0.1:8786"
        ) from error
