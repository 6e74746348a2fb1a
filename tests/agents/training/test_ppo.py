"""Proximal policy optimisation part by part, against closed forms and plain loops."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.agents.training import ppo
from stickslip.envs import FunctionalEnv


class CorridorState(NamedTuple):
    """Steps from the terminating end, and steps made."""

    left: jax.Array
    elapsed: jax.Array
    total: jax.Array


class CorridorParams(NamedTuple):
    """Control period [s], length [steps], and steps after which an episode is cut off."""

    control_period: float = 0.1
    length: int = 6
    limit: int = 4


@dataclass(frozen=True)
class Corridor(FunctionalEnv[CorridorState, CorridorParams]):
    """One step nearer to the end a step, reward 1 each; a start is 1 to `length` steps from it.

    So the value of a place is the sum of discount^k over the steps that are left, also where the
    episode is cut off before them. The observation is the place alone.
    """

    autoreset: str = "same_step"
    action_names = ("push",)
    params_kind = CorridorParams

    @property
    def default_params(self):
        return CorridorParams()

    def reset_env(self, key, params):
        left = jax.random.randint(key, (), 1, params.length + 1)
        state = CorridorState(left, jnp.zeros_like(left), jnp.zeros(()))
        return self._observe(state), state

    def step_env(self, state, action, params):
        after = CorridorState(state.left - 1, state.elapsed + 1, state.total + 1)
        terminated = after.left <= 0
        truncated = ~terminated & (after.elapsed >= params.limit)
        info = {"episode_return": after.total, "episode_length": after.elapsed}
        return self._observe(after), after, jnp.ones(()), terminated, truncated, info

    def observation_bounds(self, params):
        return np.zeros(1), np.full(1, 100.0)

    def is_over(self, state):
        return state.left <= 0

    def pictures(self, states, infos, params):
        raise NotImplementedError

    def _observe(self, state):
        return jnp.asarray(state.left, jnp.float32)[None]


@dataclass(frozen=True)
class Slope(Corridor):
    """The reward is the action, the cost its square."""

    def step_env(self, state, action, params):
        obs, after, _, *ends, info = super().step_env(state, action, params)
        return obs, after, action[0], *ends, info | {"cost": action[0] ** 2}


def learnt(env, sizes, rates, updates: int, multiplier=None, limit=None, kept: tuple = ()):
    """A learner after so many updates, the last one's losses and what it was learnt from."""
    learner = ppo.begin_learning(1, 1, sizes, jax.random.key(1))._replace(multiplier=multiplier)
    progress, key = ppo.begin_episodes(env, PARAMS, sizes, 1)
    for update in range(updates):
        now, each = rates.at(jnp.float32(update / updates)), jax.random.fold_in(key, update)
        found = ROLL(env, PARAMS, sizes, now[1], learner, progress, kept)
        progress = found.progress
        learner, losses = IMPROVE(learner, found, sizes, rates, now, each, limit)
    return learner, losses, found


def value(left: jax.Array, discount: float) -> jax.Array:
    """Of places so many steps from the end."""
    return (1 - discount**left) / (1 - discount)


ENV, PARAMS = Corridor(), CorridorParams()
SIZES = ppo.Sizes(num_envs=16, rollout_steps=24, batch_size=96, epochs=2, hidden=8)
RATES = ppo.Rates(discount=0.9, gae_lambda=0.8)
ROLL = jax.jit(ppo.rollout, static_argnums=(0, 2, 6))
IMPROVE = jax.jit(ppo.improve, static_argnums=2)


def test_advantages_are_the_sums_that_define_them():
    random = np.random.default_rng(0)
    steps, discount, weight = 7, 0.9, 0.6
    reward, values, later = random.normal(size=(3, steps, 1))
    terminated, truncated = np.zeros((2, steps, 1), bool)
    terminated[2], truncated[4] = True, True
    found = ppo.advantages(reward, terminated, truncated, values, later, discount, weight)
    for first in range(steps):
        expected = 0.0
        for at in range(first, steps):
            after = 0.0 if terminated[at, 0] else later[at, 0]
            surprise = reward[at, 0] + discount * after - values[at, 0]
            expected += (discount * weight) ** (at - first) * surprise
            if terminated[at, 0] or truncated[at, 0]:
                break
        assert found[first, 0] == pytest.approx(expected, abs=1e-5)


def test_the_critic_learns_the_value_in_closed_form():
    """The limit of 4 steps cuts off most episodes of up to 6: the critic is to see past it."""
    sizes = SIZES._replace(epochs=8, hidden=16)
    rates = RATES._replace(learning_rate=1e-2, noise=0.01, final_noise=0.01)
    learner, losses, _ = learnt(ENV, sizes, rates, 100)
    places = np.arange(1, 7)
    said = ppo.network(learner.critic, learner.seen).unlimited(places[:, None].astype(np.float32))
    np.testing.assert_allclose(said[:, 0], value(places, 0.9), atol=0.1)
    assert float(losses["explained_variance"]) > 0.95
    assert value(6, 0.9) - (1 - 0.9**4) / 0.1 > 1  # what stopping at the limit would be worth


def test_the_cost_goes_to_its_limit_and_is_not_seen_without_one():
    """Earning a at a cost of a^2, the best within a cost of 0.25 is a = 0.5, at a price of 1."""
    rates = RATES._replace(learning_rate=1e-2, noise=0.1, final_noise=0.02)
    for limit, multiplier, cost in ((0.25, jnp.log(0.7), 0.25), (None, None, 1.0)):
        learner, _, found = learnt(Slope(), SIZES, rates, 150, multiplier, limit, ("cost",))
        assert float(found.kept["cost"].mean()) == pytest.approx(cost, abs=0.08)
        if multiplier is not None:
            assert float(jnp.exp(learner.multiplier)) == pytest.approx(1.0, abs=0.3)


def test_an_action_is_drawn_with_the_probability_that_learning_uses():
    """Beyond the environment's bounds, too: the probability is of the number before clipping."""
    learner = ppo.begin_learning(3, 2, SIZES, jax.random.key(0))
    policy, noise = ppo.network(learner.actor, learner.seen), jnp.float32(2.0)
    obs = jnp.asarray([0.3, -1.0, 2.0])
    draws = jax.vmap(lambda key: ppo.explore((policy, noise), obs, key))(
        jax.random.split(jax.random.key(1), 20_000)
    )
    mean = policy.unlimited(obs)
    assert np.abs(draws).max() > 1
    np.testing.assert_allclose(draws.mean(0), mean, atol=0.06)
    np.testing.assert_allclose(draws.std(0), 2.0, atol=0.06)
    exact = jax.scipy.stats.norm.logpdf(draws, mean, noise).sum(-1) + math.log(2 * math.pi)
    np.testing.assert_allclose(ppo.log_probability(draws, mean, noise), exact, atol=1e-4)


def test_the_loss_is_the_clipped_surrogate_and_the_square_of_the_values_error():
    """Of samples on both sides of both limits, judged good and bad (Schulman et al. 2017)."""
    rng, noise, limit = np.random.default_rng(0), jnp.float32(0.3), 0.2
    learner = ppo.begin_learning(1, 1, SIZES, jax.random.key(1))
    obs, action = jnp.asarray(rng.normal(size=(2, 60, 1)), jnp.float32)
    mean = ppo.network(learner.actor, learner.seen).unlimited(obs)
    said = np.asarray(ppo.network(learner.critic, learner.seen).unlimited(obs)[:, 0], float)
    ratio, gain = rng.uniform(0.5, 1.6, 60), rng.normal(size=60)
    earned = rng.normal(size=60)
    before = ppo.log_probability(action, mean, noise) - jnp.asarray(np.log(ratio), jnp.float32)
    given = (jnp.asarray(of, jnp.float32) for of in (gain, earned))
    batch = ppo.Batch(obs, action, before, *given)
    loss, about = ppo.loss_of((learner.actor, learner.critic), learner.seen, batch, noise, limit)
    good = (gain - gain.mean()) / gain.std()
    # what is better counts up to the upper limit, what is worse from the lower one on
    counted = np.where(good > 0, np.minimum(ratio, 1 + limit), np.maximum(ratio, 1 - limit))
    policy, error = -np.mean(counted * good), np.mean((said - earned) ** 2)
    assert float(about["policy_loss"]) == pytest.approx(policy, rel=1e-4, abs=1e-5)
    assert float(about["value_loss"]) == pytest.approx(error, rel=1e-5)
    assert float(loss) == pytest.approx(policy + ppo.VALUE_WEIGHT * error, rel=1e-4, abs=1e-5)
    outside = np.mean(np.abs(ratio - 1) > limit)
    assert float(about["clip_fraction"]) == pytest.approx(outside, abs=1e-6)


def test_moments_are_those_of_everything_seen():
    random = np.random.default_rng(2)
    parts = [random.normal(3.0, [1.0, 50.0], (size, 2)).astype(np.float32) for size in (5, 300, 40)]
    seen = ppo.Moments(jnp.zeros(2), jnp.ones(2), jnp.zeros(()))
    for part in parts:
        seen = ppo.add_moments(seen, jnp.asarray(part))
    every = np.concatenate(parts)
    np.testing.assert_allclose(seen.mean, every.mean(0), rtol=1e-5)
    np.testing.assert_allclose(seen.variance, every.var(0), rtol=1e-4)
    assert seen.number == 345
