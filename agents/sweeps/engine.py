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
PAUSE, CONNECT, RETRIES = 0.05, 30.0, 3
"""Pause between two looks at Dask's tasks, and how long a scheduler may take to answer [s];
repetitions of a cell whose worker failed."""
LOST = "the Dask scheduler does not answer any more: start it again, and continue with --resume"


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
    where the scheduler is lost; ValueError where none answers at first.
    """
    with ExitStack() as stack:
        client = _client(stack, workers, scheduler, processes)
        sent = client.submit(bytes, content, pure=False)  # once, not with each cell
        given: dict[Future, int] = {
            client.submit(_play, sent, number, retries=RETRIES, pure=False): number
            for number in todo
        }
        try:
            while given:
                if stop():
                    raise StoppedError
                time.sleep(PAUSE)
                for task in [one for one in given if one.status != "pending"]:
                    keep(given[task], cast("Found", _result(task)))
                    del given[task]
                if client.status != "running":
                    raise OSError(LOST)
        finally:
            if client.status == "running":
                client.cancel(list(given), force=True)


def _play(content: bytes, number: int) -> object:
    """Play a cell in a worker."""
    return _loaded(content)(number)


@lru_cache(maxsize=4)
def _loaded(content: bytes) -> Callable[[int], object]:
    return pickle.loads(content)()


def _result(task: Future) -> object:
    """What a worker returned, or raised."""
    from concurrent.futures import CancelledError

    from distributed import KilledWorker

    try:
        return task.result(timeout=CONNECT)
    except KilledWorker as error:
        raise OSError(
            f"a cell ended {RETRIES} workers, one after the other; accepted: workers with more "
            "memory. What was written stays"
        ) from error
    except (CancelledError, TimeoutError) as error:
        raise OSError(LOST) from error


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
