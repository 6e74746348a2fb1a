"""The walks of a population, all in one program: where they get to, and how far off that is."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.tradeoff.population import DEFAULT_LENGTH, DEFAULT_TIME, PERIOD, Walks
from stickslip.dynamics.biped import EventExact, Table, prepare, step
from stickslip.dynamics.biped.recommendation import WALK_PER_RADIAN
from stickslip.dynamics.biped.setting import own_time
from stickslip.dynamics.biped.walk_check import Path, amplification, walk_errors

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.dynamics.biped.model import Fidelity
    from stickslip.dynamics.biped.setting import Setting

FINE = Table(64, 9)
REFERENCE = EventExact(rtol=1e-12, atol=1e-15)
"""What all settings are compared with, in float64 on the table FINE."""
SMOOTH = EventExact(rtol=1e-9, atol=1e-12, max_steps=256)
"""What the sensitivity is computed through."""
SHORTEST = 10
"""Walks that leave the model within fewer control periods are left out."""


def march(integrator, model, scene, state, law, period) -> Path:
    """One walk of a population, a call of `step` each control period; `kinds` holds the switches
    so far."""
    gain, wanted, torques = law

    def control(carry, extra):
        state, status, switches = carry
        torque = gain * (wanted - state.crank_rate) + extra
        after, contact = step(model, scene, state, torque, period, integrator=integrator)
        running = status <= 1
        state = jax.tree.map(lambda new, old: jnp.where(running, new, old), after, state)
        status = jnp.maximum(status, contact.status)
        switches = switches + jnp.where(running, contact.switches, 0)
        row = Path(state.crank_angle, state.foot_position, status, None, switches)
        return (state, status, switches), row

    none = jnp.zeros((), jnp.int32)
    return jax.lax.scan(control, (state, none, none), torques)[1]


def arguments(walks: Walks, fidelity: Fidelity, dtype: str) -> tuple[Any, ...]:
    """Prepared robots and the rest in this precision: what `march` takes after the integrator."""
    params = _cast(walks.params, dtype)
    rest = (_cast(part, dtype) for part in (walks.scene, walks.state, walks.law, walks.period))
    return jax.block_until_ready(_prepared(fidelity)(params)), *rest


_PREPARED: dict[Any, Callable[..., Any]] = {}


def _prepared(fidelity: Fidelity) -> Callable[..., Any]:
    """One compilation for every kind of floor."""
    return _PREPARED.setdefault(fidelity, jax.jit(jax.vmap(partial(prepare, fidelity=fidelity))))


def _cast(part, dtype: str):
    def one(leaf):
        array = np.asarray(leaf)
        return jnp.asarray(array, dtype if array.dtype.kind == "f" else jnp.int32)

    return jax.tree.map(one, part)


def paths(walks: Walks, setting: Setting) -> Path:
    """Every walk at a setting, whose dt is the default robot's, as NumPy arrays."""
    integrator = setting.integrator_over(PERIOD * DEFAULT_TIME)
    with jax.enable_x64(setting.dtype == "float64"), jax.numpy_dtype_promotion("strict"):
        given = arguments(walks, setting.fidelity, setting.dtype)
        found = jax.jit(jax.vmap(partial(march, integrator)))(*given)
        return jax.tree.map(np.asarray, found)


def references(walks: Walks, integrator: EventExact = REFERENCE) -> Path:
    """Every walk, event-exact."""
    with jax.enable_x64(True), jax.numpy_dtype_promotion("strict"):
        given = arguments(walks, FINE, "float64")
        return jax.tree.map(np.asarray, jax.jit(jax.vmap(partial(march, integrator)))(*given))


def sensitivities(walks: Walks) -> np.ndarray:
    """How much each walk amplifies, the largest along it while it is inside the model; one by one,
    and NaN where it did not converge."""

    def one(given):
        model, scene, state, law, period = given
        size = model.params.crank, own_time(model.params)
        again = lambda state: march(SMOOTH, model, scene, state, law, period)  # noqa: E731
        path, grown = amplification(again, state, *size)
        most = jnp.max(jnp.where(path.status <= 1, grown, 0.0))
        return jnp.where(path.status[-1] == 9, jnp.nan, most)

    with jax.enable_x64(True):
        given = arguments(walks, FINE, "float64")
        return np.asarray(jax.jit(partial(jax.lax.map, one))(given))


def walked(truth: Path) -> np.ndarray:
    """How many control periods each walk stays inside the model."""
    return np.sum(truth.status <= 1, axis=-1)


def errors(walks: Walks, paths: Path, truth: Path) -> np.ndarray:
    """Joint, angle and slide error of each walk for each second walked [3, n].

    As for the default robot: rad/s and m/s with times and lengths in its units, so that robots of
    any size compare. Joint: the worse of both, a slide counting as the turn that walks as far.
    Infinite for a walk that ends before its reference.
    """
    angle, slide = walk_errors(paths, truth)
    seconds = np.maximum(walked(truth), 1) * PERIOD * DEFAULT_TIME
    slide = slide * DEFAULT_LENGTH / np.asarray(walks.params.crank)
    joint = np.maximum(angle, slide / WALK_PER_RADIAN)
    return np.stack([joint, angle, slide]) / seconds
