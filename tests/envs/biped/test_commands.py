"""A commanded rate that changes in the episode."""

from __future__ import annotations

from functools import lru_cache

import jax
import numpy as np
import pytest

from stickslip.envs import BipedEnv, Randomisation

PERIOD, RANGE = 0.02, (1.0, 3.0)
STEPS = 60


def ranges(interval: tuple[float, float] | None) -> Randomisation:
    return Randomisation(mean_rate=RANGE, command_interval=interval)


@lru_cache
def walk(low: float, high: float, seed: int = 0):
    """Commands observed before each step, and the rewards of standing still."""
    env = BipedEnv(autoreset="disabled")
    params = env.make_params(scene="firm", randomisation=ranges((low, high)))
    obs, state = env.reset(jax.random.key(seed), params)
    seen, earned = [], []
    for _ in range(STEPS):
        seen.append(float(obs[5]))
        obs, state, _, _, _, info = env.step(jax.random.key(0), state, [0.0], params)
        earned.append(float(info["reward_tracking"]))
    return np.asarray(seen), np.asarray(earned), state


def test_the_command_changes_after_each_interval_and_only_then():
    seen = walk(0.3, 0.3)[0]
    changes = 1 + np.flatnonzero(np.diff(seen))
    assert changes.tolist() == [15, 30, 45]  # 0.3 s are 15 control periods
    assert len(set(seen)) == 4
    assert np.all((seen >= RANGE[0]) & (seen <= RANGE[1]))


def test_a_step_is_judged_by_the_command_that_was_observed_before_it():
    env = BipedEnv(autoreset="disabled")
    params = env.make_params(scene="firm", randomisation=ranges((PERIOD, PERIOD)))
    key = jax.random.key(5)
    obs, state = env.reset(key, params)
    seen = float(obs[5])
    obs, state, _, _, _, info = env.step(key, state, [0.2], params)
    speed = seen / np.pi * float(params.robot.step_length)
    expected = PERIOD * max(-1.0, 1 - abs(float(info["walking_speed"]) - speed) / speed)
    assert float(info["reward_tracking"]) == pytest.approx(expected, rel=1e-4)
    assert float(obs[5]) != seen


def test_what_is_not_asked_for_leaves_a_reset_as_it_was():
    env = BipedEnv()
    first = env.reset(jax.random.key(1), env.make_params(randomisation=ranges((1.0, 2.0))))[1]
    other = env.reset(jax.random.key(1), env.make_params(randomisation=ranges(None)))[1]
    assert other.drawn.commands is None
    assert float(first.drawn.mean_rate) == float(other.drawn.mean_rate)
    assert len(jax.tree.leaves(first)) == len(jax.tree.leaves(other)) + 4
