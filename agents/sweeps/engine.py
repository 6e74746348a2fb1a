"""Playing the chunks of a sweep in this process: every core, or every device."""

from __future__ import annotations

from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from dataclasses import dataclass
from itertools import count
from queue import Empty, SimpleQueue
from threading import Event
from typing import TYPE_CHECKING

import jax

from stickslip.agents.sweeps.directory import chunk_path
from stickslip.agents.sweeps.parquet import chunk_table, write_chunk
from stickslip.agents.sweeps.play import Player, StoppedError
from stickslip.dynamics.checks import require_integer
from stickslip.envs.collecting import cores_here

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    import numpy as np
    from jaxtyping import PyTree

    from stickslip.agents.sweeps.plan import Plan

POLL = 0.2
"""How often `stop` is asked [s]."""


@dataclass(frozen=True)
class Watch:
    """Who is told of what. advance: of episodes played. stop: whether to end before the end."""

    advance: Callable[[int], None] = lambda count: None
    stop: Callable[[], bool] = lambda: False


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


def run_here(plan: Plan, path: Path, todo: Sequence[int], threads: int, watch: Watch) -> int:
    """Play the chunks and write each as it is done; return how many programs were compiled.

    A thread keeps to a device and takes the next chunk that nobody has. What fails in one ends the
    others at their next tile, and is raised; what is written stays. StoppedError where `watch.stop`
    says so.
    """
    player, waiting, ended = Player(plan), SimpleQueue[int](), Event()
    for index in todo:
        waiting.put(index)
    devices, turn = devices_here() or [None], count()

    def work() -> None:
        device = devices[next(turn) % len(devices)]
        while not ended.is_set():
            try:
                chunk = plan.chunks[waiting.get_nowait()]
            except Empty:
                return
            columns = player.play(chunk, device, watch.advance, ended.is_set)
            keep_chunk(plan, path, chunk.number, columns)

    with ThreadPoolExecutor(min(threads, max(1, len(todo)))) as pool:
        running = {pool.submit(work) for _ in range(min(threads, len(todo)))}
        try:
            while running:
                done, running = wait(running, POLL, FIRST_EXCEPTION)
                for one in done:
                    one.result()
                if watch.stop():
                    raise StoppedError
        finally:
            ended.set()
    return player.programs.count


def keep_chunk(plan: Plan, path: Path, index: int, columns: dict[str, np.ndarray]) -> None:
    """Write a chunk. OSError naming the file and what to do where the disk will not take it."""
    file = chunk_path(path, index)
    try:
        write_chunk(file, chunk_table(plan, plan.chunks[index], columns))
    except OSError as error:
        raise OSError(
            error.errno,
            f"{file}: {error.strerror or error}; what was written before is whole: make room, and "
            "go on with --resume",
        ) from error
