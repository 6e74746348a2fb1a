"""Stacked frames are the steps before, and a policy with history stacks them as the environment."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.agents.evaluation.rollout import rollout
from stickslip.envs import BipedEnv, FrameStack, GymEnv, GymVectorEnv, collect
from tests.agents.networks import make_policy
from tests.envs.toy import Toy, ToyParams

STEPS, PARAMS = 3, ToyParams(limit=5)
ACTIONS = np.float32([[0.2, 0.1], [-0.4, 0.0], [3.0, -0.5], [0.5, 1.0], [0.1, 0.1], [-1.0, 0.3]])


def test_frames_are_the_steps_of_this_episode_the_latest_first():
    plain, env, key = Toy(), FrameStack(Toy(), STEPS), jax.random.key(3)
    obs, state = plain.reset(key, PARAMS)
    stacked, held = env.reset(key, PARAMS)
    before: list[np.ndarray] = []
    for action in ACTIONS:  # the fifth ends the episode
        wanted = [obs, *before, np.zeros((STEPS - len(before), len(obs) + 2)).ravel()]
        np.testing.assert_array_equal(stacked, np.concatenate(wanted))
        before = [np.append(obs, np.clip(action, -1, 1)), *before][:STEPS]
        obs, state, *told, info = plain.step(key, state, action, PARAMS)
        stacked, held, *also, stacked_info = env.step(key, held, action, PARAMS)
        np.testing.assert_array_equal(told, also)
        last = [info["final_obs"], *before, np.zeros((STEPS - len(before), len(obs) + 2)).ravel()]
        np.testing.assert_array_equal(stacked_info["final_obs"], np.concatenate(last))
        before = [] if told[1] or told[2] else before


def test_a_policy_with_history_plays_as_its_network_on_stacked_frames():
    width = len(Toy().observation_bounds(PARAMS)[0])
    network = make_policy((width + STEPS * (width + 2), 8, 2))
    policy = replace(network, history=STEPS).validate()
    assert policy.observation_size == width
    for seed in range(3):
        played = rollout(Toy(), policy, PARAMS, seed)
        stacked = rollout(FrameStack(Toy(), STEPS), network, PARAMS, seed)
        np.testing.assert_array_equal(played.action, stacked.action)
        np.testing.assert_array_equal(played.reward, stacked.reward)
        assert np.ptp(played.action) > 0.1


def test_every_adapter_takes_stacked_frames_and_draws_what_is_beneath():
    env = GymEnv(FrameStack(Toy(), STEPS, "disabled"), PARAMS, render_mode="rgb_array")
    plain = GymEnv(Toy("disabled"), PARAMS, render_mode="rgb_array")
    plain.reset(seed=0)
    first = env.reset(seed=0)[0]
    assert first in env.observation_space
    for action in ACTIONS[:4]:
        plain.step(action)
        assert env.step(action)[0] in env.observation_space
    np.testing.assert_array_equal(env.render(), plain.render())
    many = GymVectorEnv(FrameStack(Toy(), STEPS, "next_step"), PARAMS, num_envs=2)
    np.testing.assert_array_equal(many.reset(seed=[0, 7])[0][0], first)
    how = {"num_envs": 2, "steps": 9, "keep": ("obs",)}
    found = collect(FrameStack(Toy(), STEPS), PARAMS, _idle, **how)
    assert found.kept["obs"].shape == (9, 2, len(first))
    assert FrameStack(BipedEnv(), STEPS).make_params(mean_rate=2.0).mean_rate == 2.0


def _idle(_: None, obs: jax.Array, key: jax.Array) -> jax.Array:
    return jnp.zeros(2)


@pytest.mark.parametrize(("env", "steps"), [(None, 2), (Toy(), 0), (Toy(), 65), (Toy(), 1.5)])
def test_bad_stacks_are_refused(env, steps):
    with pytest.raises(ValueError, match="accepted"):
        FrameStack(env, steps)
