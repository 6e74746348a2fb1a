"""Errors of settings on the population: its walks in one program, and quantiles with confidence."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache, lru_cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.points import upper_bound
from benchmarks.report import code_of
from benchmarks.tradeoff.population import (
    DEFAULT_LENGTH,
    DEFAULT_TIME,
    FLOORS,
    PERIOD,
    ROBOTS,
    Walks,
    both,
)
from stickslip.dynamics.biped import EventExact, RK4Split, Table, prepare, step
from stickslip.dynamics.biped.recommendation import CONFIDENCE, QUANTILES, WALK_PER_RADIAN
from stickslip.dynamics.biped.settings import Setting

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.dynamics.biped.settings import Fidelity

CONTROL = 0.02
"""Control period [s]."""
REFERENCE = Setting(Table(64, 9), EventExact(rtol=1e-12, atol=1e-15), CONTROL, "float64")
"""Setting that the others are compared with."""
SHORTEST = 10
"""Walks that leave the model within fewer control periods are left out."""


class Path(NamedTuple):
    """A walk at the ends of the torques' periods [n], and its switches so far."""

    angle: Any
    slide: Any
    status: Any
    switches: Any = None


def walk_errors(own: Path, truth: Path) -> tuple[np.ndarray, np.ndarray]:
    """Largest differences of crank angle [rad] and slide [m] while the reference is inside.

    Infinite where `own` ends before it, or is no number; 0 where the reference never was inside.
    """
    inside, runs = (np.asarray(path.status) <= 1 for path in (truth, own))

    def largest(mine: np.ndarray, true: np.ndarray) -> np.ndarray:
        off = np.abs(np.asarray(mine, np.float64) - np.asarray(true, np.float64))
        off = np.where(runs & np.isfinite(off), off, np.inf)
        return np.max(np.where(inside, off, 0.0), axis=-1)

    return largest(own.angle, truth.angle), largest(own.slide, truth.slide)


def march(integrator, model, scene, state, law, period) -> Path:
    """One walk of a population, a call of `step` each control period."""
    gain, wanted, torques = law

    def control(carry, extra):
        state, status, switches = carry
        torque = gain * (wanted - state.crank_rate) + extra
        after, contact = step(model, scene, state, torque, period, integrator=integrator)
        running = status <= 1
        state = jax.tree.map(lambda new, old: jnp.where(running, new, old), after, state)
        status = jnp.maximum(status, contact.status)
        switches = switches + jnp.where(running, contact.switches, 0)
        row = Path(state.crank_angle, state.foot_position, status, switches)
        return (state, status, switches), row

    none = jnp.zeros((), jnp.int32)
    return jax.lax.scan(control, (state, none, none), torques)[1]


def arguments(walks: Walks, fidelity: Fidelity, dtype: str) -> tuple[Any, ...]:
    """Prepared robots and the rest in this precision: what `march` takes after the integrator."""
    params = _cast(walks.params, dtype)
    rest = (_cast(part, dtype) for part in (walks.scene, walks.state, walks.law, walks.period))
    return jax.block_until_ready(_prepared(fidelity)(params)), *rest


@cache
def _prepared(fidelity: Fidelity) -> Callable[..., Any]:
    """One compilation for every kind of floor."""
    return jax.jit(jax.vmap(partial(prepare, fidelity=fidelity)))


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


def walked(truth: Path) -> np.ndarray:
    """Number of control periods that each walk stays inside the model."""
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


COUNT = 512
"""Walks of each kind of robot on each kind of floor."""


def settings(quick: bool) -> list[Setting]:
    """The settings that are measured; steps of the default robot."""
    table, fine = Table(), Table(64, 9)

    def split(fidelity: Table, dtype: str, *counts: int) -> list[Setting]:
        return [Setting(fidelity, RK4Split(), CONTROL / n, dtype) for n in counts]

    if quick:
        return split(table, "float32", 1, 4)
    return [
        *split(Table(8, 4), "float32", 1, 2),
        *split(table, "float32", 1, 2, 4, 8),
        *split(table, "float64", 1, 2, 4, 8, 16),
        *split(fine, "float64", 16, 64),
        Setting(table, EventExact(rtol=1e-4, atol=1e-7), CONTROL, "float64"),
        Setting(table, EventExact(rtol=1e-7, atol=1e-10), CONTROL, "float64"),
        Setting(fine, EventExact(rtol=1e-10, atol=1e-13), CONTROL, "float64"),
    ]


def names_of(setting: Setting) -> dict[str, Any]:
    """A setting's fidelity and integrator as code, its dtype and step."""
    return {
        "fidelity": code_of(setting.fidelity, "pieces", "degree"),
        "integrator": code_of(setting.integrator),
        "dtype": setting.dtype,
        "dt": setting.dt,
    }


@lru_cache(maxsize=1)
def drawn(floor: str, count: int) -> tuple[Walks, Path, dict[str, np.ndarray]]:
    """Walks, references, and the walks of each kind of robot that last long enough."""
    with jax.enable_x64(True):
        walks = both(floor, range(count))
    truth = paths(walks, REFERENCE)
    long = walked(truth) >= SHORTEST
    groups = {
        robots: np.flatnonzero(long[i * count : (i + 1) * count]) + i * count
        for i, robots in enumerate(ROBOTS)
    }
    return walks, truth, groups


def samples(quick: bool) -> Iterator[dict[str, Any]]:
    """A row for each floor and kind of robots: what the walks are like."""
    count = 48 if quick else COUNT
    for floor in FLOORS:
        _, truth, groups = drawn(floor, count)
        for robots, own in groups.items():
            status = truth.status[own, -1]
            yield {
                "scene": floor,
                "robots": robots,
                "seeds": [0, count - 1],
                "count": len(own),
                "too_short": count - len(own),
                "left": float(np.mean(status > 1)),
                "not_converged": float(np.mean(status == 9)),
                "switches": float(np.median(truth.switches[own, -1])),
            }


def population(quick: bool) -> Iterator[dict[str, Any]]:
    """A row for each floor, setting and kind of robots."""
    for floor in FLOORS:
        walks, truth, groups = drawn(floor, 48 if quick else COUNT)
        for setting in settings(quick):
            path = paths(walks, setting)
            off = errors(walks, path, truth)
            for robots, own in groups.items():
                names = {"scene": floor, "robots": robots, **names_of(setting)}
                yield names | _quantiles(off, path, truth, own)


def _quantiles(off: np.ndarray, path: Path, truth: Path, own: np.ndarray) -> dict[str, Any]:
    ends, wanted = path.status[own, -1], truth.status[own, -1]
    over, ended = ends > 1, wanted > 1
    return {
        "bounds": {
            str(q): [_number(upper_bound(one, q, CONFIDENCE)) for one in off[:, own]]
            for q in QUANTILES
        },
        "median": float(np.median(off[0][own])),
        "worst": _number(float(np.max(off[0][own]))),
        "ends_otherwise": float(np.mean((over != ended) | (over & (ends != wanted)))),
        "other_switches": float(np.mean(path.switches[own, -1] != truth.switches[own, -1])),
    }


def _number(value: float) -> float | None:
    """None for an error without bound, which JSON has no number for."""
    return float(value) if np.isfinite(value) else None
