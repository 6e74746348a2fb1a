"""PPO as purejaxrl writes it: one compiled function over an environment of gymnax's five values.

Of its habits, those that differ from ours: the noise is learnt, episodes that time ends count as
if they had ended (their loops read `done`), the value's change is clipped, too.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import optax

from stickslip.envs.adapters.gymnax import GymnaxEnv

FARTHEST = 10.0
"""Of a normalised observation."""


@dataclass(frozen=True)
class Settings:
    """Of a training, static."""

    num_envs: int
    rollout_steps: int
    minibatches: int
    epochs: int
    updates: int
    learning_rate: float
    discount: float
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    noise: float = 0.3
    hidden: int = 64


class Seen(NamedTuple):
    """Of all observations so far."""

    mean: Any
    variance: Any
    number: Any


class Runner(NamedTuple):
    """All that goes on."""

    networks: Any
    optimiser: Any
    seen: Seen
    state: Any
    obs: Any
    key: Any


class Transition(NamedTuple):
    """Of a step of every environment."""

    obs: Any
    action: Any
    log_probability: Any
    value: Any
    reward: Any
    done: Any


def network(layers: Any, x: Any) -> Any:
    """A perceptron with tanh."""
    for weight, bias in layers[:-1]:
        x = jnp.tanh(x @ weight + bias)
    return x @ layers[-1][0] + layers[-1][1]


def normalised(seen: Seen, obs: Any) -> Any:
    """By what was seen."""
    return jnp.clip((obs - seen.mean) / jnp.sqrt(seen.variance + 1e-8), -FARTHEST, FARTHEST)


def log_probability(action: Any, mean: Any, log_std: Any) -> Any:
    """Of a normal distribution, the constant aside."""
    return -jnp.sum(0.5 * ((action - mean) / jnp.exp(log_std)) ** 2 + log_std, -1)


def begin(env: GymnaxEnv, settings: Settings, optimiser: Any, seed: int) -> Runner:
    """Before the first update."""
    key, first, second, third = jax.random.split(jax.random.key(seed), 4)
    obs, state = jax.vmap(env.reset)(jax.random.split(first, settings.num_envs))
    inner = (obs.shape[-1], settings.hidden, settings.hidden)

    def layers(key: Any, widths: tuple[int, ...], last: float) -> Any:
        gains = [2**0.5] * (len(widths) - 2) + [last]
        keys = jax.random.split(key, len(gains))
        return [
            (jax.nn.initializers.orthogonal(gain)(key, shape), jnp.zeros(shape[1]))
            for key, gain, shape in zip(keys, gains, itertools.pairwise(widths), strict=True)
        ]

    networks = {
        "actor": layers(second, (*inner, env.num_actions), 0.01),
        "critic": layers(third, (*inner, 1), 1.0),
        "log_std": jnp.full(env.num_actions, math.log(settings.noise)),
    }
    seen = Seen(jnp.zeros(obs.shape[-1]), jnp.ones(obs.shape[-1]), jnp.float32(1e-4))
    begun = Runner(networks, optimiser.init(networks), seen, state, obs, key)
    return jax.tree.map(lambda x: jax.lax.convert_element_type(x, x.dtype), begun)  # none is weak


def optimiser_of(settings: Settings) -> Any:
    """Adam with a rate that falls to zero."""
    steps = settings.updates * settings.epochs * settings.minibatches
    rate = optax.linear_schedule(settings.learning_rate, 0.0, steps)
    return optax.chain(optax.clip_by_global_norm(0.5), optax.adam(rate, eps=1e-5))


@partial(jax.jit, static_argnums=(0, 1, 2, 3))
def advance(env: GymnaxEnv, settings: Settings, optimiser: Any, updates: int, runner: Runner):
    """So many updates, and the mean reward of each."""

    def one(runner: Runner, _: None) -> tuple[Runner, Any]:
        runner, rows = jax.lax.scan(partial(step, env), runner, None, settings.rollout_steps)
        runner = improve(settings, optimiser, runner, rows)
        return runner, rows.reward.mean()

    return jax.lax.scan(one, runner, None, updates)


def step(env: GymnaxEnv, runner: Runner, _: None) -> tuple[Runner, Transition]:
    """One step of all environments."""
    key, noise, keys = jax.random.split(runner.key, 3)
    seen = widened(runner.seen, runner.obs)
    obs, networks = normalised(seen, runner.obs), runner.networks
    mean, log_std = network(networks["actor"], obs), networks["log_std"]
    action = mean + jnp.exp(log_std) * jax.random.normal(noise, mean.shape)
    after, state, reward, done, _ = jax.vmap(env.step)(
        jax.random.split(keys, len(obs)), runner.state, action
    )
    row = Transition(
        obs,
        action,
        log_probability(action, mean, log_std),
        network(networks["critic"], obs)[:, 0],
        reward,
        done,
    )
    return Runner(networks, runner.optimiser, seen, state, after, key), row


def widened(seen: Seen, obs: Any) -> Seen:
    """With these observations."""
    number = seen.number + len(obs)
    apart, share = obs.mean(0) - seen.mean, len(obs) / number
    variance = (1 - share) * seen.variance + share * obs.var(0) + share * (1 - share) * apart**2
    return Seen(seen.mean + share * apart, variance, number)


def advantages(settings: Settings, rows: Transition, last: Any) -> Any:
    """Generalised; an episode's end ends them, whatever ended it."""

    def back(carry: tuple[Any, Any], row: Transition) -> tuple[tuple[Any, Any], Any]:
        later, value = carry
        goes_on = settings.discount * (1 - row.done)
        here = row.reward + goes_on * value - row.value + goes_on * settings.gae_lambda * later
        return (here, row.value), here

    return jax.lax.scan(back, (jnp.zeros_like(last), last), rows, reverse=True)[1]


def improve(settings: Settings, optimiser: Any, runner: Runner, rows: Transition) -> Runner:
    """Passes over a rollout in minibatches."""
    last = network(runner.networks["critic"], normalised(runner.seen, runner.obs))[:, 0]
    gain = advantages(settings, rows, last)
    flat = jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:]), (rows, gain, gain + rows.value))

    def minibatch(carry: Any, chosen: Any) -> tuple[Any, None]:
        networks, state = carry
        batch = jax.tree.map(lambda x: x[chosen], flat)
        change, state = optimiser.update(jax.grad(loss)(networks, settings, *batch), state)
        return (optax.apply_updates(networks, change), state), None

    def epoch(carry: Any, key: Any) -> tuple[Any, None]:
        order = jax.random.permutation(key, len(flat[1])).reshape(settings.minibatches, -1)
        return jax.lax.scan(minibatch, carry, order)

    key, own = jax.random.split(runner.key)
    start = runner.networks, runner.optimiser
    (networks, state), _ = jax.lax.scan(epoch, start, jax.random.split(own, settings.epochs))
    return runner._replace(networks=networks, optimiser=state, key=key)


def loss(networks: Any, settings: Settings, row: Transition, gain: Any, target: Any) -> Any:
    """The clipped surrogate, and the value's clipped error."""
    clip = settings.clip_range
    mean, log_std = network(networks["actor"], row.obs), networks["log_std"]
    ratio = jnp.exp(log_probability(row.action, mean, log_std) - row.log_probability)
    gain = (gain - gain.mean()) / (gain.std() + 1e-8)
    surrogate = jnp.minimum(ratio * gain, jnp.clip(ratio, 1 - clip, 1 + clip) * gain)
    value = network(networks["critic"], row.obs)[:, 0]
    near = row.value + jnp.clip(value - row.value, -clip, clip)
    error = jnp.maximum((value - target) ** 2, (near - target) ** 2)
    return 0.25 * error.mean() - surrogate.mean()
