"""A hundred thousand random steps each: nothing passes unmarked, nobody disturbs anybody else."""

from __future__ import annotations

from collections import Counter
from functools import lru_cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Status, biped
from tests.fuzz.members import Members, at, members, robots, scene_of, unmarked

pytestmark = pytest.mark.long

COUNT = 4096
SPOILT = 64
INTEGRATORS: dict[str, Any] = {
    "euler": biped.Euler(2),
    "rk4_split": biped.RK4Split(),
    "event_exact": biped.EventExact(1e-6, 1e-9, max_steps=200),
}
CASES = [
    *[(name, "uniform") for name in INTEGRATORS],
    ("euler", "patches"),
    ("rk4_split", "patches"),
    ("event_exact", "patches"),
    ("rk4_split", "grip"),
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
        return biped.step(model, scene, state, torque, dt, integrator=INTEGRATORS[name])

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


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize(("name", "floor"), CASES)
def test_random_steps_are_sound_or_marked_and_leave_each_other_alone(name, floor, dtype):
    floors = [case for case in CASES if case[0] == name]
    rounds = -(-STEPS // (COUNT * len(floors)))
    with jax.enable_x64(dtype == "float64"):
        run = partial(stepping(name, floor), robots(dtype))
        first = CASES.index((name, floor)) * 2 + DTYPES.index(dtype)
        seeds = range(first, first + 100 * rounds, 100)
        status = np.concatenate([sound_and_alone(run, dtype, seed) for seed in seeds])
    counts = dict(Counter(Status(int(word)).name for word in status).most_common())
    print(f"\nstep {name} {floor} {dtype}: {len(status)} | {counts}")


def sound_and_alone(run: Any, dtype: str, seed: int) -> np.ndarray:
    """The statuses of a batch, after the same batch with some members spoilt."""
    given = members(COUNT, dtype, seed, special=0.1)
    after, contact = jax.tree.map(np.asarray, run(*given))
    assert after.phase.dtype == dtype
    assert not np.any(unmarked(contact.status, (after, contact)))
    low, high = biped.SUPPORT_START - SLACK, biped.SUPPORT_END + SLACK
    begun = np.asarray(given.state.phase)
    outside = ~((begun >= low) & (begun <= high))
    assert np.all((after.phase >= low) & (after.phase <= high) | outside)
    ended = np.isin(contact.status, [Status.NO_SOLUTION, Status.NON_FINITE, Status.NO_EXCHANGE])
    assert np.all(ended[outside])
    assert np.all((contact.status >= 0) & (contact.status <= max(Status)))
    spoilt, chosen = spoil(given, seed)
    other = run(*spoilt)
    assert np.all(np.asarray(other[1].status)[chosen] == Status.NON_FINITE)
    same_but(chosen, (after, contact), other)
    return contact.status
