"""What a reset draws: within the ranges, new every time, the same for the same key."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.biped import BipedParams
from stickslip.envs import BipedEnv, BipedEnvParams, Randomisation
from tests.envs.helpers import RANGES, actions, rollout, task

pytestmark = pytest.mark.long

NAMES = [one.name for one in fields(Randomisation) if getattr(RANGES, one.name) is not None]


@lru_cache
def many_resets(seed: int = 0):
    """Observations and states of 500 resets of the task that draws everything."""
    env, params = task("random")
    keys = jax.random.split(jax.random.key(seed), 500)
    return jax.tree.map(np.asarray, jax.vmap(env.reset, (0, None))(keys, params))


def drawn(state) -> dict[str, np.ndarray]:
    values = {name: one for name, one in state.drawn._asdict().items() if one is not None}
    return values | {"phase": state.biped.phase, "crank_rate": state.biped.crank_rate}


@pytest.mark.parametrize("name", NAMES)
def test_draws_fill_their_range_and_stay_inside_it(name):
    low, high = getattr(RANGES, name)
    values = drawn(many_resets()[1])[name]
    assert np.all(values >= np.float32(low))
    assert np.all(values <= np.float32(high))
    assert values.min() < low + 0.02 * (high - low)
    assert values.max() > high - 0.02 * (high - low)
    assert values.mean() == pytest.approx((low + high) / 2, abs=0.05 * (high - low))
    assert len(np.unique(values)) > 490


def test_every_episode_of_a_walker_draws_anew():
    env, params = task("random")
    run = rollout(env, params, actions(0.3))
    for i in range(2):
        resets = np.flatnonzero(run.info["autoreset"][i])
        assert len(resets) > 5
        for name, values in drawn(run.state).items():
            assert len(np.unique(values[i, resets])) == len(resets), name


def test_nothing_is_drawn_and_nothing_compiled_for_it_unless_asked_for():
    env, params = task()
    program = str(jax.make_jaxpr(env.reset_env)(jax.random.key(0), params))
    assert "random_bits" not in program
    assert "random_bits" in str(jax.make_jaxpr(env.reset_env)(jax.random.key(0), task("random")[1]))
    one, other = (env.reset(jax.random.key(seed), params)[1] for seed in (0, 1))
    assert jax.tree.all(jax.tree.map(np.array_equal, one, other))
    assert float(one.biped.phase) == np.float32(np.pi / 2)
    assert float(one.biped.crank_rate) == 0.0
    assert params.unit_payload is None


@pytest.mark.parametrize("name", NAMES)
def test_one_range_alone_draws_one_thing_alone(name):
    env = BipedEnv()
    chosen = Randomisation(**{name: getattr(RANGES, name)})
    params = replace(task()[1], randomisation=chosen)
    states = [env.reset(jax.random.key(seed), params)[1] for seed in (0, 1)]
    one, other = map(drawn, states)
    assert {key for key in one if one[key] != other[key]} == {name}


@lru_cache
def loaded_task(mass: float, payload: float) -> tuple[BipedEnv, BipedEnvParams]:
    """Every reset draws exactly this mass factor and this payload."""
    ranges = Randomisation(mass=(mass, mass), payload=(payload, payload))
    env = BipedEnv()
    return env, env.make_params(randomisation=ranges, dtype=jnp.float64)


def rebuilt_task(mass: float, payload: float) -> tuple[BipedEnv, BipedEnvParams]:
    """A robot built with these masses from the start."""
    bare = BipedParams.from_bars(dtype=jnp.float64)
    heavy = bare.replace(mass=bare.mass * mass, inertia=bare.inertia * mass, payload=payload)
    env = BipedEnv()
    return env, env.make_params(robot=heavy, dtype=jnp.float64)


@pytest.mark.parametrize(("mass", "payload"), [(1.0, 0.0), (1.3, 0.0), (0.7, 0.8), (1.2, 2.0)])
def test_a_drawn_load_walks_as_a_robot_built_with_it(float64, mass, payload):
    given = actions(0.2)[:, :]
    one = rollout(*loaded_task(mass, payload), given)
    other = rollout(*rebuilt_task(mass, payload), given)
    assert one.info["slid"].any()
    for name in ("obs", "reward", "terminated", "truncated"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-7)
    for name in one.info:
        np.testing.assert_allclose(one.info[name], other.info[name], atol=1e-5, err_msg=name)
