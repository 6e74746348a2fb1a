"""Processor time of a simulated second, by floor, setting and batch."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.timing import CORES, built, on_threads, seconds_of_many
from benchmarks.tradeoff.walks import CONTROL as PERIOD
from benchmarks.tradeoff.walks import FLOORS, names_of, settings
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import (
    BipedModel,
    BipedParams,
    BipedState,
    EventExact,
    Table,
    prepare,
    simulate,
    step,
)

if TYPE_CHECKING:
    from stickslip.dynamics.biped.settings import Setting

BATCH = 4096
PATIENCE = 0.1
"""Length of a timed run of a batch [s]; the median of three counts."""
TRUTH = {"fidelity": Table(64, 9), "integrator": EventExact(rtol=1e-10, atol=1e-13)}


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
    """Processor and wall seconds for each simulated second of each environment.

    One environment: the walk itself. A batch: two threads with half of it each, from states all
    along the walk, crank rates apart by up to 1 %.
    """
    with jax.enable_x64(setting.dtype == "float64"), jax.numpy_dtype_promotion("strict"):
        alone = partial(advance, setting.integrator, *arguments(walk, setting))
        state = start(walk, setting.dtype)
        one = built(alone, state, *numbers(setting, 1)).call
        whole = partial(one, state, *numbers(setting, round(walk.duration / PERIOD)))
        processor, wall = seconds_of_many(lambda n: [whole() for _ in range(n)], 0.0, 5, 1)
        states = spread(along, batch // CORES, setting.dtype)
        many = built(jax.vmap(alone, (0, None, None, None)), states, *numbers(setting, 1)).call

        def together(periods: int) -> list[Any]:
            return on_threads([partial(many, states, *numbers(setting, periods))] * CORES)

        processors, walls = seconds_of_many(together, CORES * PATIENCE, 3, 50)
    simulated = batch * PERIOD
    return {
        "cost_1": processor / walk.duration,
        "wall_1": wall / walk.duration,
        "cost_4096": processors / CORES / simulated,
        "wall_4096": walls / simulated,
    }


def numbers(setting: Setting, periods: int) -> tuple:
    """Step size, steps a control period and control periods, as arrays of one program."""
    count = round(PERIOD / setting.dt)
    return jnp.asarray(setting.dt, setting.dtype), jnp.int32(count), jnp.int32(periods)


def advance(integrator, model, scene, law, state: BipedState, dt, count, periods):
    """State and gravest status after `periods` control periods of `count` steps each."""
    gain, wanted = law

    def substep(torque, carry):
        state, status = carry
        after, contact = step(model, scene, state, torque, dt, integrator=integrator)
        after = jax.tree.map(lambda new, old: jnp.where(status <= 1, new, old), after, state)
        return after, jnp.maximum(status, contact.status)

    def period(_, carry):
        torque = gain * (wanted - carry[0].crank_rate)
        return jax.lax.fori_loop(0, count, lambda _, now: substep(torque, now), carry)

    return jax.lax.fori_loop(0, periods, period, (state, jnp.zeros((), jnp.int32)))


def arguments(walk: Walk, setting: Setting) -> tuple[BipedModel, Scene, tuple]:
    """The prepared default robot, the floor and the torque's law in the setting's precision."""
    params = BipedParams.from_bars(dtype=jnp.dtype(setting.dtype))
    model = jax.jit(partial(prepare, fidelity=setting.fidelity))(params)
    scene = jax.tree.map(lambda leaf: jnp.asarray(leaf, setting.dtype), walk.scene())
    law = tuple(jnp.asarray(value, setting.dtype) for value in (walk.gain, walk.wanted))
    return jax.block_until_ready(model), scene, law


def states_along(walk: Walk) -> BipedState:
    """States at the ends of the walk's control periods, event-exact in float64."""
    with jax.enable_x64(True):
        params, state = BipedParams.from_bars(dtype=jnp.float64), start(walk, "float64")
        times = walk.duration, PERIOD

        def torque(state: BipedState) -> Any:
            return walk.gain * (walk.wanted - state.crank_rate)

        found = simulate(params, walk.scene(), state, torque, *times, **TRUTH)  # type: ignore[arg-type]
        return jax.tree.map(lambda leaf: np.asarray(leaf)[1:], found.states)


def start(walk: Walk, dtype: str) -> BipedState:
    """The walk's initial state."""
    return BipedState(crank_rate=walk.rate).astype(dtype)


def spread(along: BipedState, batch: int, dtype: str) -> BipedState:
    """Initial states of a batch: those along the walk, crank rates apart by up to 1 %."""
    picked = jax.tree.map(lambda leaf: leaf[np.arange(batch) % len(leaf)], along)
    nudge = 1 + 0.01 * np.random.default_rng(0).uniform(-1, 1, batch)
    rates = {"crank_rate": picked.crank_rate * nudge, "time": np.zeros(batch)}
    return replace(picked, **rates).astype(dtype)
