"""A hundred thousand random steps each: nothing passes unmarked, nobody disturbs anybody else.

Run with -s for the counts that docs/performance.md quotes.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Status
from stickslip.dynamics.biped import (
    RK4,
    SUPPORT_END,
    SUPPORT_START,
    Euler,
    EventExact,
    RK4Split,
    SemiImplicitEuler,
    Setting,
    step,
)
from stickslip.envs import BipedEnv, Randomisation
from tests.fuzz.members import Members, at, members, robots, scene_of, unmarked

pytestmark = pytest.mark.long

COUNT = 4096
SPOILT = 64
INTEGRATORS: dict[str, Any] = {
    "euler": Euler(2),
    "semi_implicit": SemiImplicitEuler(2),
    "rk4": RK4(),
    "rk4_split": RK4Split(),
    "event_exact": EventExact(1e-6, 1e-9, max_steps=200),
}
CASES = [
    *[(name, "uniform") for name in INTEGRATORS],
    ("euler", "patches"),
    ("rk4_split", "patches"),
    ("event_exact", "patches"),
    ("rk4", "smoothed"),
    ("event_exact", "smoothed"),
    ("rk4_split", "grip"),
    ("semi_implicit", "patches"),
    ("rk4", "patches"),
    ("rk4_split", "smoothed"),
]
DTYPES = ("float32", "float64")
STEPS = 100_000
"""At least so many of every integrator in either precision, over its floors."""
SLACK = 2e-3
"""How far outside the support phase a walk may begin and end [rad]."""


@lru_cache
def stepping(name: str, floor: str):
    """A batch of steps as one compiled function of the pool and the members."""

    def one(pool, robot, state, torque, dt, friction):
        model, scene = at(pool, robot), scene_of(floor, friction)
        return step(model, scene, state, torque, dt, integrator=INTEGRATORS[name])

    return jax.jit(jax.vmap(one, (None, 0, 0, 0, 0, 0)))


def spoil(given: Members, seed: int) -> tuple[Members, np.ndarray]:
    """The batch with some members' torques or steps made no numbers; which they are."""
    random = np.random.default_rng(seed)
    chosen = np.zeros(COUNT, bool)
    chosen[random.choice(COUNT, SPOILT, replace=False)] = True
    part = chosen & (np.arange(COUNT) % 2 == 0)
    torque = jnp.where(part, jnp.nan, given.torque).astype(given.torque.dtype)
    dt = jnp.where(chosen & ~part, jnp.inf, given.dt).astype(given.dt.dtype)
    return given._replace(torque=torque, dt=dt), chosen


def same_but(chosen: np.ndarray, one: Any, other: Any) -> None:
    """Bit by bit the same outside the chosen members."""
    for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True):
        kept = np.asarray(a)[~chosen], np.asarray(b)[~chosen]
        assert kept[0].tobytes() == kept[1].tobytes()


def tell(what: str, status: np.ndarray) -> None:
    counts = Counter(Status(int(word)).name for word in status)
    print(f"\n{what}: {len(status)} | {dict(counts.most_common())}")


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize(("name", "floor"), CASES)
def test_random_steps_are_sound_or_marked_and_leave_each_other_alone(name, floor, dtype):
    floors = [case for case in CASES if case[0] == name]
    rounds = -(-STEPS // (COUNT * len(floors)))
    with jax.enable_x64(dtype == "float64"):
        run = partial(stepping(name, floor), robots(dtype))
        first = CASES.index((name, floor)) * 2 + DTYPES.index(dtype)
        seeds = range(first, first + 100 * rounds, 100)
        found = [sound_and_alone(run, dtype, seed) for seed in seeds]
        tell(f"step {name} {floor} {dtype}", np.concatenate(found))


def sound_and_alone(run: Any, dtype: str, seed: int) -> np.ndarray:
    """The statuses of a batch, after the same batch with some members spoilt."""
    given = members(COUNT, dtype, seed, special=0.1)
    after, contact = jax.tree.map(np.asarray, run(*given))
    assert after.phase.dtype == dtype
    assert not np.any(unmarked(contact.status, (after, contact)))
    within = (after.phase >= SUPPORT_START - SLACK) & (after.phase <= SUPPORT_END + SLACK)
    begun = np.asarray(given.state.phase)
    outside = ~((begun >= SUPPORT_START - SLACK) & (begun <= SUPPORT_END + SLACK))
    assert np.all(within | outside)
    ended = np.isin(contact.status, [Status.NO_SOLUTION, Status.NON_FINITE, Status.NO_EXCHANGE])
    assert np.all(ended[outside])
    assert np.all((contact.status >= 0) & (contact.status <= max(Status)))
    spoilt, chosen = spoil(given, seed)
    other = run(*spoilt)
    assert np.all(np.asarray(other[1].status)[chosen] == Status.NON_FINITE)
    same_but(chosen, (after, contact), other)
    return contact.status


RANGES = Randomisation(
    friction=(0.2, 5.0),
    mass=(0.1, 10.0),
    payload=(0.0, 20.0),
    mean_rate=(0.5, 10.0),
    phase=(SUPPORT_START, SUPPORT_END),
    crank_rate=(-10.0, 15.0),
)


@lru_cache
def environment(name: str, floor: str, dtype: str):
    setting = Setting(integrator=INTEGRATORS[name], dt=0.01, dtype=dtype)
    env = BipedEnv(setting=setting, see_friction=floor != "grip")
    scene = scene_of(floor, np.asarray([0.1, 0.8, 0.05, 0.06], dtype))
    ranges = RANGES if floor != "grip" else replace(RANGES, friction=None)
    params = env.make_params(scene=scene, randomisation=ranges, dtype=dtype)

    @jax.jit
    def run(keys, actions, spoilt):
        """A control step for each action; the torque of the spoilt ones is no number."""

        def one(key, actions, spoilt):
            state = env.reset_env(key, params)[1]

            def body(state, action):
                action = jnp.where(spoilt, jnp.nan, action)
                after = env.step_env(state, jnp.clip(action, -1, 1), params)
                return after[1], after

            return jax.lax.scan(body, state, actions)[1]

        return jax.vmap(one)(keys, actions, spoilt)

    return run


CONTROLLED = [(name, "uniform") for name in INTEGRATORS]
CONTROLLED += [("rk4_split", "patches"), ("rk4_split", "grip"), ("event_exact", "patches")]


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize(("name", "floor"), CONTROLLED)
def test_random_control_steps_are_sound_or_marked_and_leave_each_other_alone(name, floor, dtype):
    with jax.enable_x64(dtype == "float64"):
        run = environment(name, floor, dtype)
        keys = jax.random.split(jax.random.key(11), COUNT)
        actions = np.random.default_rng(3).uniform(-1, 1, (COUNT, 3, 1)).astype(dtype)
        nobody = jnp.zeros(COUNT, bool)
        obs, state, reward, terminated, truncated, info = found = run(keys, actions, nobody)
        status = np.asarray(info["status"])
        assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves((obs, reward, info)))
        assert np.all(np.isfinite(np.asarray(state.biped.phase)))
        assert np.array_equal(np.asarray(terminated), status > Status.SLIP_ONSET)
        assert not np.any(truncated)
        tell(f"BipedEnv.step {name} {floor} {dtype}", status.ravel())
        chosen = np.arange(COUNT) % 67 == 5
        other = run(keys, actions, jnp.asarray(chosen))
        assert np.all(np.asarray(other[5]["status"])[chosen] == Status.NON_FINITE)
        assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(other[2:]))
        same_but(chosen, found, other)
