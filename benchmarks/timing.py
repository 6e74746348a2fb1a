"""Programs compiled ahead of time, and what a run of them takes."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import jax
import numpy as np

from stickslip.dynamics.kernels.grouping import SWITCH


def built(function: Callable[..., Any], *arguments: Any) -> tuple[Callable[..., Any], float]:
    """Compile `function` for these arguments' shapes: the program, and the seconds that it took."""
    begun = time.perf_counter()
    call = jax.jit(function).lower(*arguments).compile()
    return call, time.perf_counter() - begun


def times_of(run: Callable[[], Any], repeats: int, longest: float = math.inf) -> np.ndarray:
    """Processor time and wall time [s] of each run [runs, 2], blocking on all outputs.

    The processor time is of all threads together. It does not grow when others want the processor.
    longest: no run is begun that, as long as the one before, would take all beyond so much [s].
    """
    taken: list[tuple[float, float]] = []
    passed = 0.0
    while len(taken) < repeats and (not taken or passed + taken[-1][1] <= longest):
        begun, used = time.perf_counter(), time.process_time()
        jax.block_until_ready(run())
        taken.append((time.process_time() - used, time.perf_counter() - begun))
        passed += taken[-1][1]
    return np.array(taken)


def seconds_of(
    run: Callable[[], Any], patience: float, repeats: int, most: int
) -> tuple[float, float]:
    """Processor time and wall time of a warm run [s]: medians over sets of up to `most` runs that
    fill `patience` [s] of processor time."""
    jax.block_until_ready(run())
    once = times_of(run, 1)[0, 0]
    count = int(np.clip(patience / max(once, 1e-7), 1, most))
    times = times_of(lambda: [run() for _ in range(count)], repeats)
    processor, wall = (np.median(times, axis=0) / count).tolist()
    return processor, wall


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
