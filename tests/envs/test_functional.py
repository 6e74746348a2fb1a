"""The protocol of the functional environments, on an environment that compiles at once."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.envs.toy import PARAMS, Toy, ToyState


@pytest.fixture
def start():
    return Toy().reset(jax.random.key(0), PARAMS)[1]


def near_the_edge(state: ToyState) -> ToyState:
    return state._replace(place=jnp.asarray(0.9, jnp.float32))


PUSH = jnp.asarray([1.0, 0.0])
KEY = jax.random.key(7)


@pytest.mark.parametrize("autoreset", ["same_step", "next_step", "disabled"])
def test_a_step_inside_an_episode_is_the_same_in_every_mode(start, autoreset):
    action = jnp.asarray([0.5, -1.0])
    found = Toy(autoreset).step(KEY, start, action, PARAMS)
    obs, state, reward, terminated, truncated, info = found
    place = float(start.place) + 0.15
    assert obs == pytest.approx([place, 1.0], abs=1e-6)
    assert float(state.place) == pytest.approx(place, abs=1e-6)
    assert float(reward) == pytest.approx(place + 0.1, abs=1e-6)
    assert not terminated
    assert not truncated
    assert not info["autoreset"]
    assert np.array_equal(info["final_obs"], obs)


def test_same_step_returns_the_next_episode_and_keeps_the_last_observation(start):
    step = Toy("same_step").step(KEY, near_the_edge(start), PUSH, PARAMS)
    obs, state, reward, terminated, truncated, info = step
    first_obs, first_state = Toy().reset(KEY, PARAMS)
    assert terminated
    assert not truncated
    assert info["autoreset"]
    assert info["final_obs"] == pytest.approx([1.2, 1.0])
    assert info["place"] == pytest.approx(1.2)
    assert float(reward) == pytest.approx(1.2)
    assert np.array_equal(obs, first_obs)
    assert jax.tree.all(jax.tree.map(np.array_equal, state, first_state))


def test_next_step_resets_one_step_later_whatever_the_action_for_no_reward(start):
    env = Toy("next_step")
    obs, ended, _, terminated, _, info = env.step(KEY, near_the_edge(start), PUSH, PARAMS)
    assert terminated
    assert not info["autoreset"]
    assert obs == pytest.approx([1.2, 1.0])
    key = jax.random.key(8)
    first_obs, first_state = env.reset(key, PARAMS)
    for action in (PUSH, -PUSH):
        obs, state, reward, terminated, truncated, info = env.step(key, ended, action, PARAMS)
        assert np.array_equal(obs, first_obs)
        assert jax.tree.all(jax.tree.map(np.array_equal, state, first_state))
        assert float(reward) == 0.0
        assert not terminated
        assert not truncated
        assert info["autoreset"]
        assert np.array_equal(info["final_obs"], first_obs)
        assert info["place"] == 0.0
        assert info["episode_length"] == 0


def test_disabled_leaves_the_finished_episode_where_it_is(start):
    found = Toy("disabled").step(KEY, near_the_edge(start), PUSH, PARAMS)
    obs, state, _, terminated, _, info = found
    assert terminated
    assert state.over
    assert not info["autoreset"]
    assert obs == pytest.approx([1.2, 1.0])
    assert np.array_equal(info["final_obs"], obs)


@pytest.mark.parametrize("autoreset", ["sometimes", None, True, ["same_step"]])
def test_an_unknown_autoreset_is_refused_with_the_known_ones(autoreset):
    with pytest.raises(ValueError, match=r"autoreset = .*'same_step', 'next_step', 'disabled'"):
        Toy(autoreset)
    with pytest.raises(ValueError, match="autoreset"):
        replace(Toy(), autoreset=autoreset)


@pytest.mark.parametrize("autoreset", ["same_step", "next_step", "disabled"])
def test_the_gradient_of_a_batch_is_that_of_its_members_and_stops_at_a_reset(start, autoreset):
    """The episode that begins does not depend on the actions of the one that ended."""
    env = Toy(autoreset)
    states = jax.tree.map(lambda *leaves: jnp.stack(leaves), start, near_the_edge(start))
    keys = jax.random.split(KEY, 2)

    def after(actions):
        return jax.vmap(env.step, (0, 0, 0, None))(keys, states, actions, PARAMS)

    def total(actions):
        obs, state, reward, _, _, info = after(actions)
        return jnp.stack([obs[:, 0], 10 * state.place, reward, info["final_obs"][:, 0]])

    actions = jnp.full((2, 2), 0.5)
    slope = jax.jacrev(jax.jit(total))(actions)
    pushed = np.zeros((4, 2, 2, 2))
    pushed[:, [0, 1], [0, 1], 0] = 0.3 * np.array([[1], [10], [1], [1]])
    pushed[2, [0, 1], [0, 1], 1] = -0.1
    if autoreset == "same_step":
        pushed[:2, 1] = 0  # the second has ended, and its next episode has begun
    np.testing.assert_allclose(slope, pushed, atol=1e-6)
