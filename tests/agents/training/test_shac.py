"""Short-horizon actor-critic: its derivative, what cuts it, and that it learns."""

from dataclasses import dataclass, replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.agents import register
from stickslip.agents.biped.config import TrainConfig
from stickslip.agents.machine import unregister
from stickslip.agents.training.run import trainer_of
from stickslip.agents.training.shac import (
    actor_loss,
    begin_learning,
    slope_step,
)
from stickslip.agents.training.trainer import Sizes, begin_episodes
from tests.agents.mass import MassConfig, MassEnv, MassMachine, MassParams

SIZES = Sizes(num_envs=6, rollout_steps=5, batch_size=15, epochs=4, hidden=4, layers=1)
EASY = MassParams(mu=0.0, mu_patch=0.0)
"""No friction: every walk is smooth."""


@pytest.fixture(autouse=True)
def _mass():
    register(MassMachine())
    yield
    unregister("mass")


def test_the_gradient_is_what_differences_show_with_the_critic_at_the_end(float64):
    """Over windows in which episodes end and begin: they are limited to 3 steps."""
    env, params = MassEnv(), replace(EASY, time_limit=0.3)
    learner = begin_learning(2, 1, SIZES, jax.random.key(0))
    learner = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), learner)
    progress = begin_episodes(env, params, SIZES, 0)[0]
    progress = progress._replace(
        state=jax.tree.map(
            lambda leaf: leaf.astype(jnp.float64) if leaf.dtype == jnp.float32 else leaf,
            progress.state,
        ),
        obs=progress.obs.astype(jnp.float64),
    )
    given = learner, env, params, SIZES, jnp.float64(0.1), 0.9, progress
    value = jax.jit(lambda actor: actor_loss(actor, *given)[0])
    gradient = jax.jit(jax.grad(lambda actor: actor_loss(actor, *given)[0]))(learner.actor)
    way = jax.tree.map(
        lambda leaf: jnp.sin(jnp.arange(leaf.size) + 1.0).reshape(leaf.shape), gradient
    )

    def moved(size: float) -> jax.Array:
        return value(jax.tree.map(lambda one, by: one + size * by, learner.actor, way))

    slope = sum(
        jnp.sum(one * by)
        for one, by in zip(jax.tree.leaves(gradient), jax.tree.leaves(way), strict=True)
    )
    assert float(slope) == pytest.approx(float((moved(1e-5) - moved(-1e-5)) / 2e-5), rel=1e-5)
    assert abs(float(slope)) > 1e-4


@dataclass(frozen=True)
class Rooted(MassEnv):
    """Pays the root of the speed, which at rest has no derivative."""

    def step_env(self, state, action, params):
        obs, after, _, terminated, truncated, info = super().step_env(state, action, params)
        return obs, after, jnp.sqrt(jnp.abs(after.speed)), terminated, truncated, info


def test_a_step_without_a_derivative_hands_back_nothing_and_others_theirs():
    env, params = Rooted(), MassParams()
    _, state = jax.vmap(lambda key: env.reset_env(key, params))(
        jax.random.split(jax.random.key(0), 2)
    )
    state = state._replace(speed=jnp.asarray([0.0, 1.0]))  # the first one sticks

    def paid(actions):
        step = jax.vmap(lambda one, action: slope_step(env, one, action, params)[2])
        return step(state, actions).sum()

    plain = jax.grad(
        lambda actions: jax.vmap(lambda one, action: env.step_env(one, action, params)[2])(
            state, actions
        ).sum()
    )
    at = jnp.full((2, 1), 0.1)
    found, unguarded = jax.grad(paid)(at), plain(at)
    assert not np.isfinite(unguarded[0])
    assert found[0] == 0
    np.testing.assert_allclose(found[1], unguarded[1], rtol=1e-6)


def config(**changes) -> MassConfig:
    usual = {"num_envs": 16, "batch_size": 64, "hidden": 16, "horizon": 8, "learning_rate": 1e-2}
    return MassConfig.of(**{"algorithm": "shac", "timesteps": 12_800, **usual, **changes})


@pytest.mark.long
def test_it_learns_to_pull_and_goes_on_from_a_checkpoint_to_the_last_bit():
    rows = []
    make = partial(trainer_of(config()), config(), MassEnv(), EASY, rows.append, lambda: False)
    whole = make()
    whole.begin_stretch(0)
    whole.advance(256)
    state = whole.take_state()
    whole.advance(512)
    again = make()
    again.put_state(state)
    again.begin_stretch(256)
    again.advance(512)
    for one, other in zip(
        jax.tree.leaves(whole.take_state()), jax.tree.leaves(again.take_state()), strict=True
    ):
        np.testing.assert_array_equal(one, other)
    rows.clear()
    whole.advance(12_800)
    ended = [row.ended["episode_return"].mean() for row in rows if row.ended]
    assert ended[-1] > ended[0] + 3
    assert whole.policy().squash == "tanh"
    assert whole.is_finite()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"algorithm": "shac", "batch_size": 100}, "num_envs x horizon = 2048"),
        ({"algorithm": "shac", "num_envs": 65536, "horizon": 4096, "batch_size": 64}, "num_envs"),
    ],
)
def test_settings_that_do_not_go_together_are_refused(given, words):
    with pytest.raises(ValueError, match=words):
        TrainConfig.of(**given)
