"""Random robots, states, torques, floors and steps, sound ones and others, by a seed."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import Patches, Scene, Status, Uniform, biped

ROBOTS = 64
SPECIAL = (np.nan, np.inf, -np.inf, 1e30, -1e30, 1e-40, 0.0, -0.0)


class Members(NamedTuple):
    """A batch: which robot of the pool, where it is, and what is done to it."""

    robot: Any
    state: biped.BipedState
    torque: Any
    dt: Any
    friction: Any
    """[n, 4] numbers of which a floor takes what it needs."""


@lru_cache
def robots(dtype: str) -> biped.BipedModel:
    """A pool of robots: scaled from 1 mm to 1 m cranks, heavy and light, and some whose lengths are
    a little off, so that they cannot exchange support or cannot close. Not validated."""
    random = np.random.default_rng(5)
    default = biped.BipedParams.from_bars(dtype=jnp.dtype(dtype))
    scale = 10.0 ** random.uniform(-1.5, 1.5, ROBOTS)
    weight = 10.0 ** random.uniform(-2, 2, ROBOTS)
    off = np.arange(ROBOTS) % 3 == 0

    def one(scale, weight, off, payload, shares):
        lengths = {}
        for i, name in enumerate(LENGTHS):
            length = getattr(default, name) * scale
            lengths[name] = length * jnp.where(off, shares[i], 1.0)
        masses = {"mass": default.mass * weight, "inertia": default.inertia * weight * scale**2}
        more = {"centre": default.centre * scale, "payload": payload * weight}
        return biped.prepare(
            biped.BipedParams(**lengths, **masses, **more, gravity=default.gravity),
            fidelity="table",
        )

    shares = random.uniform(0.95, 1.05, (ROBOTS, len(LENGTHS)))
    load = random.uniform(0, 20, ROBOTS) * (random.uniform(size=ROBOTS) < 0.5)
    given = [jnp.asarray(value, dtype) for value in (scale, weight, load, shares)]
    with jax.numpy_dtype_promotion("standard"):
        return jax.jit(jax.vmap(one))(given[0], given[1], jnp.asarray(off), given[2], given[3])


LENGTHS = (
    "crank", "ground_link", "rod", "rod_pin", "rocker", "tendon_drop", "upper_tendon",
    "lower_tendon", "femur", "femur_pin", "tibia", "tibia_pin", "stabiliser", "slot_depth",
    "offset", "heel", "toe",
)  # fmt: skip


def members(count: int, dtype: str, seed: int, special: float) -> Members:
    """A batch; in a share `special` of it one number is replaced by one of SPECIAL."""
    random = np.random.default_rng(seed)

    def spread(low: float, high: float) -> np.ndarray:
        """Either sign, logarithmically even."""
        sign = random.choice([-1.0, 1.0], count)
        return sign * 10.0 ** random.uniform(np.log10(low), np.log10(high), count)

    def some(share: float, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        return np.where(random.uniform(size=count) < share, one, other)

    phase = random.uniform(biped.SUPPORT_START, biped.SUPPORT_END, count)
    ends = random.choice([biped.SUPPORT_START, biped.SUPPORT_END, np.pi], count)
    zero = np.zeros(count)
    columns = {
        "phase": some(0.1, ends, phase),
        "crank_rate": some(0.15, zero, some(0.7, random.normal(0, 4, count), spread(1e-6, 1e4))),
        "foot_position": random.normal(0, 0.1, count),
        "foot_velocity": some(
            0.5, zero, some(0.8, random.normal(0, 0.2, count), spread(1e-9, 1e3))
        ),
        "time": random.uniform(0, 100, count),
        "torque": some(0.1, zero, some(0.6, random.normal(0, 2, count), spread(1e-4, 1e5))),
        "dt": 10.0 ** random.uniform(-6, 0, count),
        "a": some(0.5, random.uniform(0.01, 0.3, count), np.abs(spread(1e-4, 3.0))),
        "b": random.uniform(0, 1, count),
        "c": random.normal(0, 0.2, count),
        "d": np.abs(spread(1e-4, 1.0)),
    }
    names = list(columns)
    for row in np.flatnonzero(random.uniform(size=count) < special):
        columns[names[random.integers(len(names))]][row] = random.choice(SPECIAL)
    with np.errstate(over="ignore"):
        numbers = {name: jnp.asarray(value.astype(dtype)) for name, value in columns.items()}
    steps = jnp.asarray(random.integers(-1000, 1000, count), jnp.int32)
    state = {name: numbers[name] for name in names[:5]}
    friction = jnp.stack([numbers[name] for name in ("a", "b", "c", "d")], -1)
    robot = jnp.asarray(random.integers(ROBOTS, size=count), jnp.int32)
    return Members(
        robot, biped.BipedState(**state, steps=steps), numbers["torque"], numbers["dt"], friction
    )


def scene_of(kind: str, friction: Any) -> Scene:
    """A floor of a kind out of a member's four numbers."""
    a, b, c, d = friction
    if kind == "grip":
        return Scene.grip()
    if kind == "uniform":
        return Scene(Uniform(a, a * b))
    static = jnp.stack([a, a * b, d])
    return Scene(Patches(jnp.stack([c, c + d]), static, static * b))


def at(tree: Any, index: Any) -> Any:
    """One member of a pool."""
    return jax.tree.map(lambda leaf: leaf[index], tree)


def unmarked(status: Any, tree: Any) -> np.ndarray:
    """Mask along the first axis: the status is not terminal and a number is not finite."""
    status = np.asarray(status)
    sound = np.ones(status.shape, bool)
    for leaf in jax.tree.leaves(tree):
        values = np.asarray(leaf)
        if np.issubdtype(values.dtype, np.floating):
            axes = tuple(range(status.ndim, values.ndim))
            sound &= np.isfinite(values).all(axis=axes)
    return ~sound & (status <= Status.SLIP_ONSET)
