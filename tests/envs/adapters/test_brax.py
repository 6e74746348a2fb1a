"""An environment in brax's conventions: its wrappers, its truncations, and its own PPO on it."""

from __future__ import annotations

from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest

pytest.importorskip("brax")

from stickslip.envs.adapters.brax import BraxEnv, fresh_episodes
from tests.envs.toy import PARAMS, Toy

KEYS = jax.random.split(jax.random.PRNGKey(0), 3)


def toy(**more) -> BraxEnv:
    return BraxEnv(Toy("same_step"), PARAMS, **more)


def played(wrapped, push: float, steps: int):
    """The states of three environments, the first one's before any step."""
    state, step = wrapped.reset(KEYS), jax.jit(wrapped.step)
    actions = jnp.tile(jnp.array([push, 0.0]), (3, 1))
    found = [state]
    for _ in range(steps):
        state = step(state, actions)
        assert jax.tree.structure(state) == jax.tree.structure(found[0])
        found.append(state)
    return found


def wrappers() -> list:
    from brax.envs.wrappers.training import wrap

    return [wrap, fresh_episodes]


@pytest.mark.parametrize("which", [0, 1], ids=["brax's own", "fresh"])
def test_time_is_a_truncation_and_a_fall_is_none(which: int):
    env = toy()
    wrapped = wrappers()[which](env, episode_length=env.episode_length)
    stood = played(wrapped, 0.0, PARAMS.limit)
    assert [float(one.done.max()) for one in stood] == [*[0.0] * PARAMS.limit, 1.0]
    assert stood[-1].info["truncation"].tolist() == [1.0] * 3
    assert stood[-1].info["steps"].tolist() == [PARAMS.limit] * 3
    assert stood[-1].obs[:, 1].tolist() == [0.0] * 3  # of the next episodes
    fell = next(one for one in played(wrapped, 1.0, PARAMS.limit) if one.done.any())
    assert fell.info["truncation"].tolist() == [0.0] * 3


def test_episodes_begin_where_brax_began_them_or_anew():
    env = toy()
    again, fresh = (
        played(wrap(env, episode_length=env.episode_length), 0.0, 2 * PARAMS.limit)
        for wrap in wrappers()
    )
    limit = PARAMS.limit
    np.testing.assert_array_equal(again[limit].obs, again[0].obs)
    starts = {float(one.obs[0, 0]) for one in (fresh[0], fresh[limit], fresh[2 * limit])}
    assert len(starts) == 3


def test_sums_of_an_episode_begin_with_it():
    env = toy(metrics=("place",))
    states = played(fresh_episodes(env, episode_length=env.episode_length), 0.5, 2 * PARAMS.limit)
    for environment in range(3):
        rewards, places = 0.0, 0.0
        for before, now in pairwise(states):
            if before.done[environment]:
                rewards, places = 0.0, 0.0
            rewards += float(now.reward[environment])
            places += float(now.metrics["place"][environment])
            sums = now.info["episode_metrics"]
            assert float(sums["sum_reward"][environment]) == pytest.approx(rewards, abs=1e-5)
            assert float(sums["place"][environment]) == pytest.approx(places, abs=1e-5)
            assert float(sums["length"][environment]) == float(now.info["steps"][environment])


def test_what_it_cannot_do_is_refused():
    env = toy()
    assert (env.observation_size, env.action_size, env.backend) == (2, 2, "stickslip")
    with pytest.raises(ValueError, match="episode_length = 6"):
        fresh_episodes(env, episode_length=env.episode_length - 1)
    with pytest.raises(ValueError, match="action_repeat = 2"):
        fresh_episodes(env, env.episode_length, action_repeat=2)
    with pytest.raises(ValueError, match="metric"):
        toy(metrics=("plaice",))
