"""stickslip: `step` with tables and event-split Runge-Kutta steps, compiled, one `vmap` a batch."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.peers.cases import DURATION, SAMPLES, SPREAD, TORQUE, Case, measured
from stickslip.dynamics.biped import BipedParams, BipedState, RK4Split, Table, prepare, step

NAME = "stickslip"
BATCH = 4096
IN_A_ROW = 256
"""Walks that a call of batch 1 takes one after another, so that the call itself weighs nothing."""
PER_SAMPLE = (1, 2, 3, 4, 6, 8, 9, 12, 16, 20, 24, 32, 48)
"""Steps between two samples."""
CONFIGURATIONS = ((np.float32, Table(128, 3)), (np.float64, Table(32, 7)))


def measure(case: Case, quick: bool) -> Iterator[dict[str, Any]]:
    """One walk and a batch at every step size, in both precisions."""
    for batch in (1, BATCH):
        for dtype, table in CONFIGURATIONS:
            torques, walks = program(case, table, dtype, batch)
            for count in PER_SAMPLE[:4] if quick else PER_SAMPLE:
                length = DURATION / (SAMPLES * count)
                size = jnp.asarray(length, dtype), jnp.asarray(count, jnp.int32)

                def run(walks=walks, torques=torques, size=size):
                    return jax.block_until_ready(walks(torques, *size))

                setting = f"{np.dtype(dtype).name}, table {table.pieces}x{table.degree}, "
                setting += f"{1e3 * length:.3g} ms"
                yield measured(NAME, case, setting, run, 5 if quick else 10, batch=batch)


def program(case: Case, table: Table, dtype: Any, batch: int):
    """Torques, and the compiled walks under them for any step size."""
    params = BipedParams.from_bars(dtype=dtype)
    model = jax.jit(partial(prepare, fidelity=table))(params)

    def walk(torque, dt, count):
        def move(_, state):
            return step(model, case.scene, state, torque, dt, integrator=RK4Split())[0]

        def sample(state, _):
            state = jax.lax.fori_loop(0, count, move, state)
            return state, state.crank_angle

        return jax.lax.scan(sample, _at_rest(dtype), length=SAMPLES)[1]

    def walks(torques, dt, count):
        one = partial(walk, dt=dt, count=count)
        return jax.lax.map(one, torques) if batch == 1 else jax.vmap(one)(torques)

    torques = np.full(IN_A_ROW, TORQUE)
    if batch > 1:  # in random order: neighbours do not switch together
        torques = np.linspace(*SPREAD, batch)
        np.random.default_rng(0).shuffle(torques[1:-1])
    return jnp.asarray(torques, dtype), jax.jit(walks)


def _at_rest(dtype: Any) -> BipedState:
    values = {name: jnp.asarray(value, dtype) for name, value in vars(BipedState()).items()}
    return BipedState(**{**values, "steps": jnp.zeros((), jnp.int32)})
