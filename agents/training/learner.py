"""Start of learning in JAX for any algorithm: networks, observation statistics, episodes.

Observations are normalised by mean and variance of all that were seen before a rollout: acting and
learning use the same numbers, which change between updates only.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp

from stickslip.agents.policy.mlp import MLPPolicy
from stickslip.envs.collecting import Progress, begin

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.agents.training.ppo.settings import Sizes
    from stickslip.envs.functional import FunctionalEnv, Params, State

LEAST_SPREAD, FARTHEST = 1e-2, 10.0
"""Of an observation's entry: the least scale, and the limit of what it is scaled to."""

Layers = tuple[tuple["Array", "Array"], ...]
"""Weights [inputs, outputs] and biases [outputs] of each layer."""


class Moments(NamedTuple):
    """Mean, mean squared distance from it, and number of all observations so far."""

    mean: Float[Array, " obs"]
    variance: Float[Array, " obs"]
    number: Float[Array, ""]


def nothing_seen(inputs: int) -> Moments:
    """Before the first of so many numbers of an observation: they stay as they are."""
    zero = jnp.zeros(inputs, jnp.float32)
    return Moments(zero, zero + 1, jnp.zeros((), jnp.float32))


def layers_of(key: Array, widths: tuple[int, ...], last: float) -> Layers:
    """Orthogonal weights, longer by sqrt(2) but for the last layer's; no biases."""
    gains = [*[2**0.5] * (len(widths) - 2), last]
    keys = jax.random.split(key, len(gains))
    shapes = itertools.pairwise(widths)
    return tuple(
        (
            jax.nn.initializers.orthogonal(gain)(key, shape, jnp.float32),
            jnp.zeros(shape[1], jnp.float32),
        )
        for gain, key, shape in zip(gains, keys, shapes, strict=True)
    )


def first_layers(inputs: int, outputs: int, sizes: Sizes, key: Array) -> tuple[Layers, Layers]:
    """Of an actor, which hardly acts, and of a critic: from so many numbers of an observation, to
    so many of an action and to one."""
    actor, critic = jax.random.split(key)
    inner = (inputs, *[sizes.hidden] * sizes.layers)
    return layers_of(actor, (*inner, outputs), 0.01), layers_of(critic, (*inner, 1), 1.0)


def network(layers: Layers, seen: Moments, squash: str = "clip") -> MLPPolicy:
    """The perceptron of these layers, observations normalised; of the actor, what is shipped."""
    scale = jnp.maximum(jnp.sqrt(seen.variance), LEAST_SPREAD)
    weights, biases = zip(*layers, strict=True)
    return MLPPolicy(weights, biases, seen.mean, scale, squash=squash, observation_clip=FARTHEST)


def explore(given: tuple[MLPPolicy, Array], obs: Float[Array, " obs"], key: Array):
    """An action drawn around the policy's; given: the policy and the noise."""
    policy, noise = given
    mean = policy.unlimited(obs)
    return mean + noise * jax.random.normal(key, mean.shape, mean.dtype)


def widened(seen: Moments, obs: Float[Array, "samples obs"]) -> Moments:
    """Mean and variance of what was seen and these."""
    number = seen.number + len(obs)
    share = len(obs) / number
    mean, variance = obs.mean(0), obs.var(0)
    apart = mean - seen.mean
    spread = (1 - share) * seen.variance + share * variance + share * (1 - share) * apart**2
    return Moments(seen.mean + share * apart, spread, number)


class Start(NamedTuple):
    """Start of a training, without its learner."""

    progress: Progress
    key: Array
    """Of its updates; that of the one i is fold_in(key, i)."""


def begin_episodes(
    env: FunctionalEnv[State, Params], params: Params, sizes: Sizes, seed: Array | int
) -> Start:
    """Fresh episodes and random numbers."""
    episodes, updates = jax.random.split(jax.random.fold_in(jax.random.key(seed), 1))
    return Start(begin(env, sizes.num_envs, params, episodes), updates)
