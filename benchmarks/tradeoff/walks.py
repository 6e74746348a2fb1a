"""Seeded walks of every kind, robots, floors, starts and torques drawn at random, and errors of
settings on them.

Walk number i is drawn from a generator of its own, seeded by i alone, so that any of them can be
had again. Everything is drawn in the robot's own units and scaled: lengths in crank lengths, times
in sqrt(crank / gravity), torques in weight times crank. In brackets: what that is for the default
robot.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, lru_cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.report import code_of, upper_bound
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START, BipedState, prepare, step
from stickslip.dynamics.biped.params import BipedParams, own_time
from stickslip.dynamics.biped.recommendation import (
    CONFIDENCE,
    DEFAULT_CRANK,
    DEFAULT_GRAVITY,
    QUANTILES,
)
from stickslip.dynamics.biped.settings import EventExact, Fidelity, RK4Split, Setting, Table

CONTROL = 0.02
"""Control period of the default robot [s]."""
DEFAULT_TIME = float(np.sqrt(DEFAULT_CRANK / DEFAULT_GRAVITY))
"""Its own time [s]."""
PERIOD = CONTROL / DEFAULT_TIME
"""The torque is held for this long, in own times [20 ms]."""
PERIODS = 100
"""Control periods of a walk [2 s]."""
FLOORS = ("smooth", "stick-slip", "ice")
ROBOTS = ("default", "others")
HELD_OUT = 10**6
"""Walks are measured with the seeds from 0, promises are tested with those from here."""
STEP = 8.0
"""Length of a step in crank lengths."""
EDGES = 4
MASSES = {"bar_density": 1.48, "hip_mass": 0.70, "foot_mass": 0.30}
"""Of the default robot [kg/m, kg]."""
COUNT = 512
"""Walks of each kind of robot on each kind of floor."""
REFERENCE = Setting(Table(64, 9), EventExact(rtol=1e-12, atol=1e-15), CONTROL, "float64")
"""Setting that the others are compared with."""
SHORTEST = 10
"""Walks that leave the model within fewer control periods are left out."""


class Walks(NamedTuple):
    """A batch of walks in SI units, one row each."""

    params: BipedParams
    scene: Scene
    state: BipedState
    law: tuple[Any, Any, Any]
    """Gain [N m s], wanted rate [rad/s], torques [n, PERIODS] added in each control period."""
    period: Any
    """[s]"""


def both(floor: str, seeds) -> Walks:
    """The walks of these seeds, first with the default robot, then with robots at random."""
    one, other = (draw(floor, seeds, robots) for robots in ROBOTS)
    return jax.tree.map(lambda a, b: np.concatenate([a, b]), one, other)


def draw(floor: str, seeds, robots: str) -> Walks:
    """The walks of these seeds on one kind of floor, in float64: call it with x64 on.

    robots: "default" for the default robot, "others" for one of each walk's own.
    """
    drawn = [_one(floor, int(seed), robots) for seed in seeds]
    columns = {name: jnp.asarray(np.array([one[name] for one in drawn])) for name in drawn[0]}
    bars = ("crank_length", "bar_density", "hip_mass", "foot_mass", "payload", "gravity")
    given: dict[str, Any] = {name: columns[name] for name in bars}
    params = BipedParams.from_bars(**given, dtype=jnp.float64)
    length, time = jnp.asarray(params.crank), own_time(params)
    moment = params.total_mass * jnp.asarray(params.gravity) * length
    zero = jnp.zeros(len(drawn))
    state = BipedState(
        phase=columns["phase"],
        steps=jnp.zeros(len(drawn), jnp.int32),
        crank_rate=columns["rate"] / time,
        foot_position=zero,
        foot_velocity=columns["velocity"] * length / time,
        time=zero,
    )
    torques = columns["torques"] * moment[:, None]
    law = columns["gain"] * moment * time, columns["wanted"] / time, torques
    return Walks(params, _floor(floor, columns, length), state, law, PERIOD * time)


def _floor(floor: str, columns: dict[str, jax.Array], length: jax.Array) -> Scene:
    if floor == "smooth":
        return Scene.grip(outputs="state")
    friction = columns["mu_static"], columns["mu_kinetic"]
    if floor == "stick-slip":
        return Scene.uniform(*friction, outputs="state")
    return Scene.patches(columns["edges"] * length[:, None], *friction, outputs="state")


def _one(floor: str, seed: int, robots: str) -> dict[str, Any]:
    """Everything about one walk, as numbers in own units."""
    rng = np.random.default_rng(seed)
    found = _robot(rng)
    if robots == "default":
        own = {"crank_length": DEFAULT_CRANK, "payload": 0.0, "gravity": DEFAULT_GRAVITY}
        found = MASSES | own
    slips = floor != "smooth" and rng.random() < 0.5
    found |= {
        "phase": rng.uniform(SUPPORT_START, SUPPORT_END),
        "rate": rng.uniform(-0.1, 0.4),  # [-1.8 to 7.2 rad/s]
        "velocity": rng.uniform(-0.5, 0.5) * slips,  # [0.27 m/s]
    }
    return found | _law(rng) | _friction(floor, rng)


def _robot(rng) -> dict[str, float]:
    def times(value: float, factor: float) -> float:
        return value * float(np.exp(rng.uniform(-1, 1) * np.log(factor)))

    return {
        "crank_length": float(np.exp(rng.uniform(np.log(0.01), np.log(0.3)))),
        **{name: times(value, 4.0) for name, value in MASSES.items()},
        "payload": float(rng.uniform(0, 10)) * (rng.random() < 0.5),
        "gravity": times(DEFAULT_GRAVITY, 2.5),
    }


def _law(rng) -> dict[str, Any]:
    """A proportional controller, one torque all along, or torques at random."""
    kind = int(rng.integers(3))
    gain, wanted, torques = 0.0, 0.0, np.zeros(PERIODS)
    if kind == 0:
        gain, wanted = rng.uniform(1.5, 11.0), rng.uniform(0.05, 0.35)  # [0.2 to 1.5, 0.9 to 6.3]
    elif kind == 1:
        torques = np.full(PERIODS, rng.uniform(-0.1, 0.25))  # [-0.25 to 0.62 N m]
    else:
        held = int(rng.integers(1, 6))
        torques = np.repeat(rng.uniform(-0.4, 0.5, PERIODS), held)[:PERIODS]  # [-1 to 1.25 N m]
    return {"gain": gain, "wanted": wanted, "torques": torques}


def _friction(floor: str, rng) -> dict[str, Any]:
    if floor == "smooth":
        return {}
    share = rng.uniform(0.6, 1.0)
    if floor == "stick-slip":
        still = float(np.exp(rng.uniform(np.log(0.02), np.log(0.5))))
        return {"mu_static": still, "mu_kinetic": share * still}
    edges = np.cumsum(rng.uniform(0.1, 1.5, EDGES)) - 0.5  # in steps
    still = np.where(
        np.arange(EDGES + 1) % 2 == 0,
        rng.uniform(0.2, 0.6, EDGES + 1),
        np.exp(rng.uniform(np.log(0.01), np.log(0.1), EDGES + 1)),
    )
    return {"edges": STEP * edges, "mu_static": still, "mu_kinetic": share * still}


class Path(NamedTuple):
    """A walk at the ends of the torques' periods [n]."""

    angle: Any
    slide: Any
    status: Any


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
        state, status = carry
        torque = gain * (wanted - state.crank_rate) + extra
        after, contact = step(model, scene, state, torque, period, integrator=integrator)
        running = status <= 1
        state = jax.tree.map(lambda new, old: jnp.where(running, new, old), after, state)
        status = jnp.maximum(status, contact.status)
        return (state, status), Path(state.crank_angle, state.foot_position, status)

    return jax.lax.scan(control, (state, jnp.zeros((), jnp.int32)), torques)[1]


@cache
def _prepared(fidelity: Fidelity) -> Callable[..., Any]:
    """One compilation for every kind of floor."""
    return jax.jit(jax.vmap(partial(prepare, fidelity=fidelity)))


def paths(walks: Walks, setting: Setting) -> Path:
    """Every walk at a setting, whose dt is the default robot's, as NumPy arrays."""
    integrator = setting.integrator_over(PERIOD * DEFAULT_TIME)

    def cast(leaf):
        array = np.asarray(leaf)
        return jnp.asarray(array, setting.dtype if array.dtype.kind == "f" else jnp.int32)

    with jax.enable_x64(setting.dtype == "float64"), jax.numpy_dtype_promotion("strict"):
        params, *rest = jax.tree.map(cast, walks)
        robots = _prepared(setting.fidelity)(params)
        found = jax.jit(jax.vmap(partial(march, integrator)))(robots, *rest)
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
    slide = slide * DEFAULT_CRANK / np.asarray(walks.params.crank)
    walk = 8 * DEFAULT_CRANK / np.pi  # of the default robot, for each radian of its crank [m]
    joint = np.maximum(angle, slide / walk)
    return np.stack([joint, angle, slide]) / seconds


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
    long = np.flatnonzero(walked(truth) >= SHORTEST)
    groups = {robots: long[long // count == i] for i, robots in enumerate(ROBOTS)}
    return walks, truth, groups


def samples(quick: bool) -> Iterator[dict[str, Any]]:
    """A row for each floor and kind of robots: number of walks that are long enough."""
    count = 48 if quick else COUNT
    for floor in FLOORS:
        for robots, own in drawn(floor, count)[2].items():
            yield {"scene": floor, "robots": robots, "count": len(own)}


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
    bounds = {str(q): [upper_bound(one, q, CONFIDENCE) for one in off[:, own]] for q in QUANTILES}
    ends, wanted = (np.maximum(one.status[own, -1], 1) for one in (path, truth))  # 0, 1: inside
    return {"bounds": bounds, "ends_otherwise": float(np.mean(ends != wanted))}
