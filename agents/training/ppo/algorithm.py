"""Proximal policy optimisation (Schulman et al. 2017) as pure functions of JAX.

One update: `rollout` steps the environments, `advantages` judges what they did, `improve` takes
gradient steps over minibatches of it. Everything that learning goes on from is a `Learner`; the
environments stand in `Progress` beside it. The trainer and the population loop around these.

An action is mean(obs) + noise * normal numbers, and its probability is that of this sum; the
environment clips it to [-1, 1], which is part of the environment. So ratios of probabilities are
exact where the clipping acts, too. The noise follows a course and is not learnt: learnt, it
vanishes before anything walks (see sb3/algorithm.py).

Observations are normalised by mean and variance of all that were seen before the rollout: acting
and learning use the same numbers, which change between updates only.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import optax

from stickslip.agents.training.learner import (
    COPIED,
    SPREAD,
    SPREAD_STEPS,
    Layers,
    Moments,
    Now,
    Rates,
    Sizes,
    explore,
    first_layers,
    laid,
    network,
    nothing_seen,
    widened,
)
from stickslip.envs.collecting import Collected, Progress, collect

if TYPE_CHECKING:
    from jax.sharding import Mesh
    from jaxtyping import Array, Bool, Float

    from stickslip.agents.training.groups import LearningConfiguration
    from stickslip.envs.functional import FunctionalEnv, Params, State


def settings_of(config: LearningConfiguration) -> tuple[Sizes, Rates]:
    """Settings of a training configuration."""
    ppo = config.ppo
    sizes = Sizes(
        num_envs=config.num_envs,
        rollout_steps=ppo.rollout_steps,
        batch_size=config.batch_size,
        epochs=ppo.epochs,
        hidden=config.hidden,
        layers=config.layers,
    )
    rates = Rates(
        learning_rate=config.learning_rate,
        final_learning_rate=config.final_learning_rate,
        noise=ppo.noise,
        final_noise=ppo.final_noise,
        discount=config.discount,
        gae_lambda=ppo.gae_lambda,
        clip_range=ppo.clip_range,
    )
    return sizes, rates


KEPT = ("obs", "action", "next_obs")
"""Kept data of each step of a rollout."""
VALUE_WEIGHT = 0.5
"""Of the value's squared error in the loss."""
STEEPEST = 0.5
"""Length to which a gradient is shortened."""

OPTIMISER = optax.chain(optax.clip_by_global_norm(STEEPEST), optax.scale_by_adam(eps=1e-5))

Carry = tuple[tuple[Layers, Layers], optax.OptState]
"""Carry of a gradient step: actor and critic, and the optimiser's state."""


class Learner(NamedTuple):
    """All that learning goes on from."""

    actor: Layers
    critic: Layers
    optimiser: optax.OptState
    """State of `OPTIMISER` over (actor, critic)."""
    seen: Moments


class Batch(NamedTuple):
    """Samples to learn from, every entry [samples, ...]."""

    obs: Array
    action: Array
    log_probability: Array
    """Of the action when it was chosen."""
    advantage: Array
    value: Array
    """Target of the critic: its old estimate plus the advantage."""


def begin_learning(inputs: int, outputs: int, sizes: Sizes, key: Array) -> Learner:
    """Initialise the learner for `inputs` observed numbers and `outputs` actions."""
    networks = first_layers(inputs, outputs, sizes, key)
    return Learner(*networks, OPTIMISER.init(networks), nothing_seen(inputs))


def rollout(
    env: FunctionalEnv[State, Params],
    params: Params,
    sizes: Sizes,
    noise: Array,
    learner: Learner,
    progress: Progress[State],
    keep: tuple[str, ...] = (),
) -> Collected[State]:
    """`rollout_steps` of every environment; keep: names of info beside `KEPT`."""
    return collect(
        env,
        params,
        explore,
        num_envs=len(progress.obs),
        steps=sizes.rollout_steps,
        policy_params=(network(learner.actor, learner.seen), noise),
        keep=(*KEPT, *keep),
        progress=progress,
    )


@partial(jax.jit, static_argnums=(0, 1, 3, 7))
def rollout_over(
    mesh: Mesh,
    env: FunctionalEnv[State, Params],
    params: Params,
    sizes: Sizes,
    noise: Array,
    learner: Learner,
    progress: Progress[State],
    keep: tuple[str, ...] = (),
) -> Collected[State]:
    """`rollout` of the environments divided over a mesh: each device steps its own.

    Every environment has its own chain of random numbers, so it does the same wherever it is.
    """

    def own(params: Params, noise: Array, learner: Learner, progress: Progress[State]):
        found = rollout(env, params, sizes, noise, learner, progress, keep)
        return found[:4], found.progress

    divided = jax.shard_map(
        own,
        mesh=mesh,
        in_specs=(COPIED, COPIED, COPIED, SPREAD),
        out_specs=(SPREAD_STEPS, SPREAD),
        check_vma=False,  # each device's part needs nothing of another's
    )
    rows, after = divided(params, noise, learner, progress)
    return Collected(*rows, after)


def advantages(
    reward: Float[Array, "steps n"],
    terminated: Bool[Array, "steps n"],
    truncated: Bool[Array, "steps n"],
    value: Float[Array, "steps n"],
    next_value: Float[Array, "steps n"],
    discount: Array | float,
    gae_lambda: Array | float,
) -> Float[Array, "steps n"]:
    """Generalised advantage estimates (Schulman et al. 2016).

    value, next_value: of the observation before a step and of the one after it, which at an
    episode's end is its last one, not the next episode's first. A terminated episode earns nothing
    more; of a truncated one next_value is what it would have gone on to earn.
    """
    surprise = reward + discount * jnp.where(terminated, 0.0, next_value) - value
    goes_on = ~(terminated | truncated)

    def back(later: Array, now: tuple[Array, Array]) -> tuple[Array, Array]:
        surprise, goes_on = now
        here = surprise + discount * gae_lambda * jnp.where(goes_on, later, 0.0)
        return here, here

    return jax.lax.scan(back, jnp.zeros_like(value[0]), (surprise, goes_on), reverse=True)[1]


def log_probability(action: Array, mean: Array, noise: Array) -> Array:
    """Of a normal distribution, the constant aside."""
    return -jnp.sum(0.5 * ((action - mean) / noise) ** 2 + jnp.log(noise), axis=-1)


def judged(learner: Learner, found: Collected, noise: Array, rates: Rates) -> Batch:
    """Samples of a rollout for the update."""
    obs, action = found.kept["obs"], found.kept["action"]
    critic = network(learner.critic, learner.seen)
    value, later = (critic.unlimited(x)[..., 0] for x in (obs, found.kept["next_obs"]))
    ends = found.terminated, found.truncated
    gain = advantages(found.reward, *ends, value, later, rates.discount, rates.gae_lambda)
    mean = network(learner.actor, learner.seen).unlimited(obs)
    batch = Batch(obs, action, log_probability(action, mean, noise), gain, value + gain)
    return jax.tree.map(lambda leaf: leaf.reshape(-1, *leaf.shape[2:]), batch)


def loss_of(
    networks: tuple[Layers, Layers], seen: Moments, batch: Batch, noise: Array, clip_range: Array
) -> tuple[Array, dict[str, Array]]:
    """The clipped surrogate and the value's error, and what to report of them."""
    actor, critic = (network(layers, seen) for layers in networks)
    mean = actor.unlimited(batch.obs)
    change = log_probability(batch.action, mean, noise) - batch.log_probability
    ratio = jnp.exp(change)
    gain = batch.advantage
    gain = (gain - gain.mean()) / (gain.std() + 1e-8)
    limited = jnp.clip(ratio, 1 - clip_range, 1 + clip_range)
    policy_loss = -jnp.minimum(ratio * gain, limited * gain).mean()
    value_loss = ((critic.unlimited(batch.obs)[..., 0] - batch.value) ** 2).mean()
    about = {
        "policy_loss": policy_loss,
        "value_loss": value_loss,
        "kl_divergence": (ratio - 1 - change).mean(),
        "clip_fraction": (jnp.abs(ratio - 1) > clip_range).mean(),
    }
    return policy_loss + VALUE_WEIGHT * value_loss, about


LOSSES = ("policy_loss", "value_loss", "kl_divergence", "clip_fraction", "explained_variance")


def improve(
    learner: Learner,
    found: Collected,
    sizes: Sizes,
    rates: Rates,
    now: Now,
    key: Array,
    mesh: Mesh | None = None,
) -> tuple[Learner, dict[str, Array]]:
    """The learner after gradient steps over a rollout, and means over them by `LOSSES`.

    mesh: each device has the whole rollout (one exchange an update) and takes its part of every
    minibatch; gradients are summed. So the minibatches are the same ones on any number of devices.
    """
    rate, noise = now
    every = laid(mesh, judged(learner, found, noise, rates), COPIED)
    samples, size = sizes.samples, sizes.batch_size

    def step(carry: Carry, rows: Array):
        networks, optimiser = carry
        rows = laid(mesh, rows, SPREAD)
        batch = jax.tree.map(lambda leaf: leaf[rows], every)
        gradient, about = jax.grad(loss_of, has_aux=True)(
            networks, learner.seen, batch, noise, rates.clip_range
        )
        change, optimiser = OPTIMISER.update(gradient, optimiser)
        networks = jax.tree.map(lambda one, by: one - rate * by, networks, change)
        return (networks, optimiser), about

    def epoch(carry: Carry, first: Array):
        return jax.lax.scan(step, carry, jnp.roll(order, first).reshape(-1, size))

    shuffling, beginning = jax.random.split(key)
    order = jnp.argsort(jax.random.bits(shuffling, (samples,)))  # sorting takes as long as an epoch
    firsts = jax.random.randint(beginning, (sizes.epochs,), 0, samples)
    start = (learner.actor, learner.critic), learner.optimiser
    ((actor, critic), optimiser), about = jax.lax.scan(epoch, start, firsts)
    losses = {name: values.mean() for name, values in about.items()}
    error = jnp.var(every.advantage) / jnp.maximum(jnp.var(every.value), 1e-12)
    losses["explained_variance"] = 1 - error
    after = Learner(actor, critic, optimiser, widened(learner.seen, every.obs))
    return laid(mesh, (after, losses), COPIED)
