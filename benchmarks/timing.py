"""Programs compiled ahead of time, and what a run of them takes."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, NamedTuple

import jax
import numpy as np

from stickslip.dynamics.kernels.grouping import SWITCH

CORES = 2
"""A batch is split over this many threads."""


class Compiled(NamedTuple):
    """A program and what it cost to build."""

    call: Callable[..., Any]
    seconds: float


def built(function: Callable[..., Any], *arguments: Any) -> Compiled:
    """Compile `function` for these arguments' shapes; seconds from Python to machine code."""
    begun = time.perf_counter()
    call = jax.jit(function).lower(*arguments).compile()
    return Compiled(call, time.perf_counter() - begun)


def seconds_of(run: Callable[[], Any], repeats: int) -> tuple[float, float]:
    """Processor time and wall time of a run [s]: medians of several, blocking on all outputs.

    The processor time is of all threads together. It does not grow when others want the processor.
    """
    taken = []
    for _ in range(repeats):
        begun, used = time.perf_counter(), time.process_time()
        jax.block_until_ready(run())
        taken.append((time.process_time() - used, time.perf_counter() - begun))
    processor, wall = np.median(taken, axis=0).tolist()
    return processor, wall


def seconds_of_many(
    runs: Callable[[int], Any], patience: float, repeats: int, most: int
) -> tuple[float, float]:
    """`seconds_of` one of n runs that fill `patience` [s] of processor time; warm. runs: of n."""
    jax.block_until_ready(runs(1))
    once, _ = seconds_of(lambda: runs(1), 1)
    count = int(np.clip(patience / max(once, 1e-7), 1, most))
    processor, wall = seconds_of(lambda: runs(count), repeats)
    return processor / count, wall / count


def on_threads(runs: list[Callable[[], Any]]) -> list[Any]:
    """Run each in a thread of its own, a single one in this; their results, or what one raised."""
    if len(runs) == 1:
        return [jax.block_until_ready(runs[0]())]
    with ThreadPoolExecutor(len(runs)) as pool:
        return list(pool.map(lambda run: jax.block_until_ready(run()), runs))


@contextmanager
def without_kernels() -> Iterator[None]:
    """Trace for plain XLA, without kernels (`stickslip.dynamics.kernels.fused`)."""
    before = os.environ.get(SWITCH)
    jax.clear_caches()
    os.environ[SWITCH] = "off"
    try:
        yield
    finally:
        os.environ.pop(SWITCH) if before is None else os.environ.update({SWITCH: before})
        jax.clear_caches()
