"""An environment in gymnax's conventions, and a training that reads nothing else."""

from __future__ import annotations

import sys
from importlib.metadata import version

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.envs.adapters.gymnax import GymnaxEnv
from tests.envs.toy import PARAMS, Toy

KEY = jax.random.key(0)


def toy(values: int = 6) -> GymnaxEnv:
    return GymnaxEnv(Toy("same_step"), PARAMS, values)


def test_a_step_gives_the_functional_environments_values_and_what_gymnax_adds():
    env, action = toy(), jnp.array([0.5, 0.0])
    obs, state = env.reset(KEY)
    assert obs.tolist() == Toy("same_step").reset(KEY, PARAMS)[0].tolist()
    for _ in range(PARAMS.limit):
        own = Toy("same_step").step(KEY, state, action, PARAMS)
        obs, state, reward, terminated, truncated, info = env.step(KEY, state, action)
        given = obs, reward, terminated, truncated
        for one, other in zip(given, own[:1] + own[2:5], strict=True):
            np.testing.assert_array_equal(one, other)
        assert bool(info["terminated"]) == bool(terminated)
        if terminated | truncated:
            break
    assert terminated | truncated
    np.testing.assert_array_equal(info["final_observation"], own[5]["final_obs"])
    np.testing.assert_array_equal(obs, env.reset(KEY)[0])  # of the next episode


def test_time_ends_an_episode_with_a_discount_of_one_and_a_fall_with_none():
    env = toy(values=5)
    step = jax.jit(env.step)
    ends = {}
    for push in (0.0, 1.0):
        state = env.reset(KEY, PARAMS)[1]
        for _ in range(PARAMS.limit):
            _, state, _, done, info = step(KEY, state, jnp.array([push, 0.0]), PARAMS)
            assert bool(done) == bool(info["terminated"] | info["truncated"])
            if done:
                break
            assert float(info["discount"]) == 1.0
        ends[push] = bool(info["truncated"]), float(info["discount"])
    assert ends == {0.0: (True, 1.0), 1.0: (False, 0.0)}


def test_bad_values_are_refused_by_name():
    with pytest.raises(ValueError, match="values = 7"):
        toy(7)
    with pytest.raises(ValueError, match="'same_step'"):
        GymnaxEnv(Toy("disabled"), PARAMS)
    with pytest.raises(ValueError, match="env = None"):
        GymnaxEnv(None, PARAMS)


def test_without_gymnax_its_spaces_say_what_to_install(monkeypatch):
    env = toy()
    for name in [name for name in sys.modules if name.partition(".")[0] == "gymnax"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "gymnax", None)
    assert env.step(KEY, env.reset(KEY)[1], jnp.zeros(2))[2].shape == ()
    with pytest.raises(ModuleNotFoundError, match=r"stickslip\[gymnax\]"):
        env.action_space()


def test_gymnaxs_wrappers_and_spaces_take_it():
    wrappers = pytest.importorskip("gymnax.wrappers")
    newer = int(version("gymnax").partition(".")[0]) >= 1
    env = toy(values=6 if newer else 5)
    box = env.observation_space(PARAMS)
    assert (box.shape, env.action_space().shape) == ((2,), (2,))
    assert bool(box.contains(env.reset(KEY)[0]))
    logged = wrappers.LogWrapper(env)
    state, total = logged.reset(KEY)[1], 0.0
    for _ in range(PARAMS.limit):
        _, state, reward, *done, info = logged.step(KEY, state, jnp.array([0.0, -1.0]))
        total += float(reward)
    assert any(map(bool, done))
    assert float(info["returned_episode_returns"]) == pytest.approx(total, rel=1e-5)
