"""Poses and equilibria a second: a plain loop, NumPy, and the package's ways, with their errors."""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import jax
import numpy as np

from benchmarks.timing import CORES, on_threads
from benchmarks.ugv import plain, tracks
from benchmarks.ugv.errors import Truth, errors_of, truth_of
from benchmarks.ugv.program import Way, given, program, timed
from stickslip.dynamics.ugv import PoseSolver, Track

BATCHES = (1, 1 << 10, 1 << 16, 1 << 20)
LOOPED = 1 << 11
"""Poses that the plain loop goes through."""
DENSITY = 8.0
"""Pieces a metre of the rough track's table; as Track.rough has it."""
BARE = PoseSolver(samples=0)

FIXED = PoseSolver(samples=0, iterations=3)

WAYS = {
    "default": (Way(), BATCHES),
    "default, no kernels": (Way(kernels=False), BATCHES[2:3]),
    "samples=0": (Way(BARE), BATCHES),
    "samples=0, no kernels": (Way(BARE, kernels=False), BATCHES[2:3]),
    "samples=0, 3 iterations": (Way(FIXED), BATCHES[2:3]),
}
"""What is measured, and with which batches."""
QUICK = ("default", "default, no kernels")


def grounds() -> dict[str, tuple[Track, Any]]:
    """The two tracks as they are sampled, and NumPy's profiles of them."""
    bump, rough = tracks.bump(), tracks.tabulated(tracks.waves(), DENSITY)
    bump_shape: Any = bump.shape
    rough_shape: Any = rough.shape
    return {
        "bump": (bump, plain.NumpyBump.of(bump_shape)),
        "rough": (rough, plain.NumpyTable.of(rough_shape)),
    }


def throughput(quick: bool) -> Iterator[dict[str, Any]]:
    """A row for each track, precision, way and batch."""
    for name, (track, profile) in grounds().items():
        truth = truth_of(track, 1 << 14)
        yield {"track": name, **_loop(profile, truth)}
        for dtype in ("float64", "float32"):
            for batch in BATCHES[1:3] if quick else BATCHES[1:]:
                yield {"track": name, **_numpy(profile, truth, dtype, batch)}
            for way, (how, batches) in WAYS.items():
                if quick and way not in QUICK:
                    continue
                for batch in batches[-1:] if quick else batches:
                    yield {"track": name, **_ours(track, truth, way, how, dtype, batch)}


def _row(way: str, dtype: str, batch: int, seconds, found, truth: Truth) -> dict[str, Any]:
    processor, wall, compile_seconds = seconds
    return {
        "way": way,
        "dtype": dtype,
        "batch": batch,
        "per_core": batch / processor,
        "wall_rate": batch / wall,
        "compile": compile_seconds,
        **errors_of(found, truth),
    }


def _loop(profile: Any, truth: Truth) -> dict[str, Any]:
    x, angles = truth.x[:LOOPED], truth.angles[:LOOPED]
    used, begun = time.process_time(), time.perf_counter()
    found = plain.loop(profile, x, angles)
    seconds = time.process_time() - used, time.perf_counter() - begun, 0.0
    return _row("plain loop, brentq", "float64", len(x), seconds, found, truth)


def _numpy(profile: Any, truth: Truth, dtype: str, batch: int) -> dict[str, Any]:
    x, angles = (np.asarray(v) for v in _arrays(dtype, batch))

    def run():
        return plain.vectorised(profile, x, angles)

    seconds = timed(run)
    return _row("NumPy, Newton", dtype, batch, seconds, run(), truth)


def _ours(track: Track, truth: Truth, name: str, way: Way, dtype: str, batch: int):
    """Two threads with half of a large batch each, as long as there are halves."""
    with jax.enable_x64(dtype == "float64"):
        parts = CORES if batch > BATCHES[1] else 1
        arguments = given(track, dtype, batch // parts)
        call = program(way, *arguments)
        run = partial(call.call, *arguments)
        both = run if parts == 1 else lambda: on_threads([run] * parts)
        seconds = timed(both, call.seconds)
        return _row(name, dtype, batch, seconds, run()._asdict(), truth)


def _arrays(dtype: str, batch: int):
    with jax.enable_x64(dtype == "float64"):
        return given(tracks.bump(), dtype, batch)[1:]
