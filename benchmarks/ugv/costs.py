"""Processor time of poses with their equilibria, by ground, solver, precision and batch."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.report import code_of
from benchmarks.timing import built, seconds_of_many
from benchmarks.ugv.promise import FRICTION, SOLVERS
from stickslip.dynamics.ugv import PoseSolver, Track, UGVParams, equilibrium
from stickslip.dynamics.ugv.ground.roughness import class_roughness, rough_waves

BATCHES = (1, 1 << 14)
START, END = 0.0, 8.0
"""Start and end of every track [m]."""
PATIENCE = 0.05
"""Length of a timed run [s]; the median of five counts."""


def waves() -> Track:
    """Rough ground of ISO class D in closed form, a sum of 64 cosines."""
    return Track(rough_waves(jax.random.key(0), class_roughness("D")), START, END)


def sines() -> Track:
    """Ground given as a function, its slopes by differentiation."""

    def height(x):
        return 0.05 * jnp.sin(2 * x + 0.3) + 0.02 * jnp.sin(5 * x + 1) + 0.006 * jnp.sin(9 * x + 2)

    return Track.from_function(height, START, END)


GROUNDS: dict[str, Callable[[], Track]] = {
    "closed": lambda: Track.bump(start=START, end=END),
    "waves": waves,
    "spline": lambda: waves().resampled(-12.0, 20.0, 512),
    "function": sines,
}
"""The track whose cost stands for a kind of ground; every table costs the same."""


def costs(quick: bool) -> Iterator[dict[str, Any]]:
    """A row for each ground, solver, precision and batch."""
    for ground in list(GROUNDS)[:2] if quick else GROUNDS:
        for solver in SOLVERS[1:2] if quick else SOLVERS:
            for dtype in ("float64", "float32"):
                for batch in BATCHES:
                    names = {"ground": ground, "solver": code_of(solver), "dtype": dtype}
                    yield {**names, "batch": batch, **cost(ground, solver, dtype, batch)}


def cost(ground: str, solver: PoseSolver, dtype: str, batch: int) -> dict[str, float]:
    """Processor, wall and compile seconds; the first two for each pose."""
    with jax.enable_x64(True):
        track = GROUNDS[ground]()
    with jax.enable_x64(dtype == "float64"):
        arguments = (track.astype(jnp.dtype(dtype)), *map(jnp.asarray, drawn(dtype, batch)))
        program = built(partial(answers, solver), *arguments)
        run = partial(program.call, *arguments)
        processor, wall = seconds_of_many(lambda n: [run() for _ in range(n)], PATIENCE, 5, 10_000)
    return {"cost": processor / batch, "wall": wall / batch, "compile": program.seconds}


def answers(solver: PoseSolver, track: Track, x, angles):
    """All that a pose of the default vehicle has: forces, torque, pose, clearance, status."""
    return equilibrium(UGVParams(), track, x, angles, FRICTION, solver=solver)


def drawn(dtype: str, batch: int) -> tuple[np.ndarray, np.ndarray]:
    """Front contacts [batch] from 2 to 7.5 m and leg angles [batch, 2] over the whole range."""
    params, random = UGVParams(), np.random.default_rng(0)
    x = random.uniform(2.0, 7.5, batch)
    angles = random.uniform(params.leg_angle_min, params.leg_angle_max, (batch, 2))
    return x.astype(dtype), angles.astype(dtype)
