"""Processor time of a simulated second, by floor, setting and batch."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.timing import built, seconds_of
from benchmarks.tradeoff.walks import CONTROL, FLOORS, names_of, settings
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, EventExact, Table, prepare, simulate
from stickslip.dynamics.biped.settings import Setting

BATCH = 4096
CORES = 2
"""A batch is split over this many threads."""
PATIENCE = 0.1
"""Length of a timed run of a batch [s]; the median of three counts."""
TRUTH = Setting(Table(64, 9), EventExact(rtol=1e-10, atol=1e-13), CONTROL, "float64")
SPAN = 0.2
"""Time that a batch is simulated for in one call [s]."""


class Walk(NamedTuple):
    """Floor, crank rate at the start [rad/s], torque = gain (wanted - rate), duration [s]."""

    scene: Callable[[], Scene]
    rate: float
    gain: float
    wanted: float
    duration: float


WALKS = {
    "smooth": Walk(lambda: Scene.grip(outputs="state"), 3.0, 1.0, 4.0, 2.0),
    "stick-slip": Walk(lambda: Scene.uniform(0.06, 0.05, outputs="state"), 4.0, 0.5, 5.0, 2.0),
    "ice": Walk(
        lambda: Scene.patches([0.23, 0.475], [0.5, 0.05, 0.5], outputs="state"), 3.0, 1.0, 4.0, 4.0
    ),
}


def costs(quick: bool) -> Iterator[dict[str, Any]]:
    """A row for each floor and setting."""
    for floor in FLOORS[:1] if quick else FLOORS:
        along = states_along(WALKS[floor])
        for setting in settings(quick):
            found = cost(WALKS[floor], along, setting, 64 if quick else BATCH)
            yield {"scene": floor, **names_of(setting), **found}


def cost(walk: Walk, along: BipedState, setting: Setting, batch: int) -> dict[str, float]:
    """Processor and wall seconds of `simulate` for each simulated second of each environment.

    One environment: the walk itself. A batch: two threads with half of it each, from states all
    along the walk, crank rates apart by up to 1 %.
    """
    with jax.enable_x64(setting.dtype == "float64"), jax.numpy_dtype_promotion("strict"):
        state = BipedState(crank_rate=walk.rate).astype(setting.dtype)
        one, _ = built(walked(walk, setting, walk.duration), state)
        processor, wall = seconds_of(partial(one, state), 0.0, 5, 1)
        states = spread(along, batch // CORES, setting.dtype)
        many, _ = built(jax.vmap(walked(walk, setting, SPAN)), states)

        def together() -> list[Any]:
            with ThreadPoolExecutor(CORES) as pool:
                return list(pool.map(lambda _: jax.block_until_ready(many(states)), range(CORES)))

        processors, _ = seconds_of(together, CORES * PATIENCE, 3, 50)
    return {
        "cost_1": processor / walk.duration,
        "wall_1": wall / walk.duration,
        "cost_4096": processors / CORES / (batch * SPAN),
    }


def walked(walk: Walk, setting: Setting, duration: float) -> Callable[[BipedState], Any]:
    """From a state of the prepared default robot to its states after every control period."""
    params = BipedParams.from_bars(dtype=jnp.dtype(setting.dtype))
    model = jax.block_until_ready(jax.jit(partial(prepare, fidelity=setting.fidelity))(params))
    scene = jax.tree.map(lambda leaf: jnp.asarray(leaf, setting.dtype), walk.scene())
    integrator = setting.integrator_over(CONTROL)

    def torque(state: BipedState) -> Any:
        return walk.gain * (walk.wanted - state.crank_rate)

    def run(state: BipedState) -> Any:
        found = simulate(model, scene, state, torque, duration, CONTROL, integrator=integrator)
        return found.states

    return run


def states_along(walk: Walk) -> BipedState:
    """States at the ends of the walk's control periods, event-exact in float64."""
    with jax.enable_x64(True):
        state = BipedState(crank_rate=walk.rate).astype("float64")
        found = walked(walk, TRUTH, walk.duration)(state)
        return jax.tree.map(lambda leaf: np.asarray(leaf)[1:], found)


def spread(along: BipedState, batch: int, dtype: str) -> BipedState:
    """Initial states of a batch: those along the walk, crank rates apart by up to 1 %."""
    picked = jax.tree.map(lambda leaf: leaf[np.arange(batch) % len(leaf)], along)
    nudge = 1 + 0.01 * np.random.default_rng(0).uniform(-1, 1, batch)
    rates = {"crank_rate": picked.crank_rate * nudge, "time": np.zeros(batch)}
    return replace(picked, **rates).astype(dtype)
