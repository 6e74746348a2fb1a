"""stickslip itself: `step` with tables for M, P, Y and event-split Runge-Kutta steps, compiled, as
it comes: one `vmap` over the batch, which XLA's CPU backend runs as one kernel a step.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.peers.cases import DURATION, SAMPLES, SPREAD, TORQUE, Case, Measured, measured
from benchmarks.timing import on_threads
from stickslip.dynamics.biped import BipedParams, BipedState, RK4Split, Table, prepare, step

NAME = "stickslip"
BATCH = 4096
IN_A_ROW = 256
"""Walks that a call of batch 1 takes one after another, so that the call itself weighs nothing."""
PER_SAMPLE = (1, 2, 3, 4, 6, 8, 9, 12, 16, 20, 24, 32, 48)
"""Steps between two samples, tried from coarse to fine."""
IN_BATCHES = (1, 2, 3, 4, 6, 8, 9, 12, 20, 32)
CONFIGURATIONS = ((np.float32, Table(128, 3)), (np.float64, Table(32, 7)))
BATCHES = ((BATCH, 1), (BATCH // 2, 2))
"""Members of a call, and calls at once, a thread each: XLA hardly uses a second core by itself."""


class Program:
    """A whole walk, compiled once for every step size: `batch` of them by vmap; a batch of 1 is
    IN_A_ROW walks one after another."""

    def __init__(self, case: Case, table: Table, dtype: Any, batch: int):
        begun = time.perf_counter()
        params = BipedParams.from_bars(dtype=dtype)
        model = jax.jit(partial(prepare, fidelity=table))(params)
        self.dtype, self.batch, self.table = dtype, batch, table

        def walk(torque, dt, count):
            def move(_, state):
                return step(model, case.scene, state, torque, dt, integrator=RK4Split())[0]

            def sample(state, _):
                state = jax.lax.fori_loop(0, count, move, state)
                return state, state.crank_angle

            return jax.lax.scan(sample, _at_rest(dtype), length=SAMPLES)[1]

        def walks(torques, *size):
            one = partial(walk, dt=size[0], count=size[1])
            return jax.lax.map(one, torques) if batch == 1 else jax.vmap(one)(torques)

        torques = np.full(IN_A_ROW, TORQUE)
        if batch > 1:  # in no order: neighbours do not switch together
            torques = np.linspace(*SPREAD, batch)
            np.random.default_rng(0).shuffle(torques[1:-1])
        self.torques = jnp.asarray(torques, dtype)
        self.compiled = jax.jit(walks).lower(self.torques, *self.size_of(1)).compile()
        self.build = time.perf_counter() - begun

    def size_of(self, per_sample: int):
        """Length [s] and number of the steps between two samples, on the device."""
        length = DURATION / (SAMPLES * per_sample)
        return jnp.asarray(length, self.dtype), jnp.asarray(per_sample, jnp.int32)

    def run(self, per_sample: int, threads: int = 1) -> jax.Array:
        """Crank angles; with several threads each runs the whole program once."""
        size = self.size_of(per_sample)
        one = partial(self.compiled, self.torques, *size)
        return on_threads([one] * threads)[0]


def measure(case: Case, quick: bool) -> Iterator[Measured]:
    """One walk at every step size, then a batch on one call and on two threads of half of it."""
    for dtype, table in CONFIGURATIONS:
        single = Program(case, table, dtype, 1)
        for per_sample in PER_SAMPLE:
            yield _measure(case, single, per_sample, quick)
    for dtype, table in CONFIGURATIONS:
        for batch, threads in BATCHES[1:] if quick else BATCHES:
            program = Program(case, table, dtype, batch)
            for per_sample in IN_BATCHES:
                yield _measure(case, program, per_sample, quick, threads)


def _measure(
    case: Case, program: Program, per_sample: int, quick: bool, threads: int = 1
) -> Measured:
    table, length = program.table, 1e3 * DURATION / (SAMPLES * per_sample)
    return measured(
        NAME,
        case,
        f"{np.dtype(program.dtype).name}, table {table.pieces}x{table.degree}, {length:.3g} ms",
        partial(program.run, per_sample, threads),
        5 if quick else 10,
        program.build,
        batch=threads * program.batch,
        threads=threads,
        walks=threads * len(program.torques),
    )


def _at_rest(dtype: Any) -> BipedState:
    values = {name: jnp.asarray(value, dtype) for name, value in vars(BipedState()).items()}
    return BipedState(**{**values, "steps": jnp.zeros((), jnp.int32)})
