"""The package's poses and equilibria as compiled programs, and how they are timed."""

from __future__ import annotations

import time
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.timing import Compiled, built, seconds_of, without_kernels
from stickslip.dynamics.ugv import PoseSolver, Track, UGVParams, equilibrium

if TYPE_CHECKING:
    from collections.abc import Callable

FRICTION = 0.8
PATIENCE = 0.05
"""About how long a timed run takes [s]; it is repeated five times."""


class Answer(NamedTuple):
    """What is asked of every pose: forces [N], torque [N m], places [m], pitch [rad]."""

    F_rear: Any
    N_rear: Any
    F_front: Any
    N_front: Any
    torque: Any
    x_rear: Any
    pitch: Any
    body_x: Any
    body_y: Any
    clearance: Any
    """Infinite where the solver looks at no samples."""
    status: Any


@dataclass(frozen=True)
class Way:
    """How a batch is computed: by which solver, and whether in kernels (`dynamics/fused.py`) or as
    XLA takes it."""

    solver: PoseSolver = field(default=PoseSolver())
    kernels: bool = True


class Timing(NamedTuple):
    """Of one call, medians: processor seconds of all threads, wall seconds, compile seconds."""

    processor: float
    wall: float
    compile: float


def drawn(dtype: str, batch: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Front contacts [batch] from 2 to 7.5 m and leg angles [batch, 2] over the whole range.

    A smaller batch is the beginning of a larger one.
    """
    params = UGVParams()
    x = np.random.default_rng((seed, 0)).uniform(2.0, 7.5, batch)
    size = (batch, 2)
    angles = np.random.default_rng((seed, 1)).uniform(
        params.leg_angle_min, params.leg_angle_max, size
    )
    # Rounded to single precision first: both precisions get the same numbers.
    return x.astype(np.float32).astype(dtype), angles.astype(np.float32).astype(dtype)


def answers(solver: PoseSolver, track: Track, x, angles) -> Answer:
    """What users call, of poses of the default vehicle, in any shape."""
    held = equilibrium(UGVParams(), track, x, angles, FRICTION, solver=solver)
    placed = held.pose
    x_body, y_body = placed.body[..., 0], placed.body[..., 1]
    return Answer(
        *held.forces,
        held.torque,
        placed.rear.x,
        placed.pitch,
        x_body,
        y_body,
        held.clearance,
        held.status,
    )


def program(way: Way, track: Track, x, angles) -> Compiled:
    """`answers` of batches like this one, compiled; of track, x and angles."""
    with nullcontext() if way.kernels else without_kernels():
        return built(partial(answers, way.solver), track, x, angles)


def given(track: Track, dtype: str, batch: int, seed: int = 0) -> tuple:
    """Track, contacts and angles as arrays of a type (under enable_x64 for float64)."""
    x, angles = drawn(dtype, batch, seed)
    return track.astype(jnp.dtype(dtype)), jnp.asarray(x), jnp.asarray(angles)


def timed(run: Callable[[], Any], compile_seconds: float = 0.0) -> Timing:
    """Processor and wall seconds of a call, warm, medians of five runs of PATIENCE each."""
    jax.block_until_ready(run())
    begun = time.process_time()
    jax.block_until_ready(run())
    count = int(np.clip(PATIENCE / max(time.process_time() - begun, 1e-7), 1, 10_000))

    def several():
        for _ in range(count):
            jax.block_until_ready(run())

    processor, wall = seconds_of(several, 5)
    return Timing(processor / count, wall / count, compile_seconds)
