"""Proximal policy optimisation (Schulman et al. 2017) in JAX.

One update: `rollout` steps the environments, `advantages` judges what they did, `improve` takes
gradient steps over minibatches of it. All that learning goes on from is a `Learner`; the
environments stand in `Progress` beside it. The trainer loops around these pure functions.

An action is mean(obs) + noise * normal numbers, and its probability is that of this sum; the
environment clips it to [-1, 1]. So ratios of probabilities are exact where the clipping acts, too.
The noise follows a schedule: learnt, it vanishes before anything walks, since standing still is a
safe local optimum (it takes a large torque at the right phase to get over the first step).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import optax

from stickslip.agents.protocol import Params, State
from stickslip.agents.training.trainer import (
    JAXTrainer,
    Layers,
    Moments,
    Now,
    Rates,
    Sizes,
    Tree,
    actor_and_critic,
    add_moments,
    network,
    no_moments,
)
from stickslip.envs.collecting import Collected, Progress, collect

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float

    from stickslip.agents.policy.network import MLPPolicy
    from stickslip.envs.functional import FunctionalEnv

KEPT = ("obs", "action", "next_obs")
"""Kept data of each step of a rollout."""
VALUE_WEIGHT = 0.5
"""Weight of the value's squared error in the loss."""
STEEPEST = 0.5
"""Length to which a gradient is shortened."""
OPTIMISER = optax.chain(optax.clip_by_global_norm(STEEPEST), optax.scale_by_adam(eps=1e-5))
LOSSES = ("policy_loss", "value_loss", "kl_divergence", "clip_fraction", "explained_variance")

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
    """Log-probability of the action when it was chosen."""
    advantage: Array
    value: Array
    """Target of the critic: its old estimate plus the advantage."""


def begin_learning(inputs: int, outputs: int, sizes: Sizes, key: Array) -> Learner:
    """Initialise the learner for `inputs` observed numbers and `outputs` actions."""
    networks = actor_and_critic(inputs, outputs, sizes, key)
    return Learner(*networks, OPTIMISER.init(networks), no_moments(inputs))


def explore(given: tuple[MLPPolicy, Array], obs: Float[Array, " obs"], key: Array):
    """An action drawn around the policy's; given: the policy and the noise."""
    policy, noise = given
    mean = policy.unlimited(obs)
    return mean + noise * jax.random.normal(key, mean.shape, mean.dtype)


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
    td_error = reward + discount * jnp.where(terminated, 0.0, next_value) - value
    goes_on = ~(terminated | truncated)

    def back(later: Array, now: tuple[Array, Array]) -> tuple[Array, Array]:
        td_error, goes_on = now
        here = td_error + discount * gae_lambda * jnp.where(goes_on, later, 0.0)
        return here, here

    return jax.lax.scan(back, jnp.zeros_like(value[0]), (td_error, goes_on), reverse=True)[1]


def log_probability(action: Array, mean: Array, noise: Array) -> Array:
    """Log-density of a normal distribution without its constant."""
    return -jnp.sum(0.5 * ((action - mean) / noise) ** 2 + jnp.log(noise), axis=-1)


def judged(critic: MLPPolicy, found: Collected, rates: Rates) -> tuple[Array, Array]:
    """Advantage of each step of a rollout [steps, n], and the critic's target."""
    value, later = (critic.unlimited(found.kept[of])[..., 0] for of in ("obs", "next_obs"))
    ends = found.terminated, found.truncated
    gain = advantages(found.reward, *ends, value, later, rates.discount, rates.gae_lambda)
    return gain, value + gain


def flattened(tree: Tree) -> Tree:
    """Every leaf [steps, n, ...] as [samples, ...]."""
    return jax.tree.map(lambda leaf: leaf.reshape(-1, *leaf.shape[2:]), tree)


def samples_of(learner: Learner, found: Collected, noise: Array, rates: Rates) -> Batch:
    """Samples of a rollout for the update."""
    obs, action = found.kept["obs"], found.kept["action"]
    advantage, value = judged(network(learner.critic, learner.seen), found, rates)
    mean = network(learner.actor, learner.seen).unlimited(obs)
    return flattened(Batch(obs, action, log_probability(action, mean, noise), advantage, value))


def loss_of(
    networks: tuple[Layers, Layers], seen: Moments, batch: Batch, noise: Array, clip_range: Array
) -> tuple[Array, dict[str, Array]]:
    """The clipped surrogate and the value's error, and what to report of them."""
    actor, critic = (network(layers, seen) for layers in networks)
    mean = actor.unlimited(batch.obs)
    change = log_probability(batch.action, mean, noise) - batch.log_probability
    ratio = jnp.exp(change)
    advantage = batch.advantage
    advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
    limited = jnp.clip(ratio, 1 - clip_range, 1 + clip_range)
    policy_loss = -jnp.minimum(ratio * advantage, limited * advantage).mean()
    value_loss = ((critic.unlimited(batch.obs)[..., 0] - batch.value) ** 2).mean()
    about = {
        "policy_loss": policy_loss,
        "value_loss": value_loss,
        "kl_divergence": (ratio - 1 - change).mean(),
        "clip_fraction": (jnp.abs(ratio - 1) > clip_range).mean(),
    }
    return policy_loss + VALUE_WEIGHT * value_loss, about


def improve(
    learner: Learner,
    found: Collected,
    sizes: Sizes,
    rates: Rates,
    now: Now,
    key: Array,
) -> tuple[Learner, dict[str, Array]]:
    """The learner after gradient steps over a rollout, and means over them by `LOSSES`."""
    rate, noise = now
    every = samples_of(learner, found, noise, rates)
    samples, size = sizes.samples, sizes.batch_size

    def step(carry: Carry, rows: Array):
        networks, optimiser = carry
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
    after = Learner(actor, critic, optimiser, add_moments(learner.seen, every.obs))
    return after, losses


def policy_of(learner: Learner) -> MLPPolicy:
    """The actor, without exploration."""
    return network(learner.actor, learner.seen)


_improve = jax.jit(improve, static_argnums=2)


class PPOTrainer(JAXTrainer[Learner, State, Params]):
    """Learns from rollouts. `stop` is asked twice an update."""

    losses = LOSSES
    first_learner = staticmethod(jax.jit(begin_learning, static_argnums=(0, 1, 2)))
    network_of = staticmethod(policy_of)

    def learnt(
        self, now: Now, key: Array
    ) -> tuple[Learner, Collected[State], dict[str, Array]] | None:
        """See JAXTrainer."""
        given = self.env, self.params, self._sizes, now.noise, self._learner, self._progress
        found = rollout(*given, self._infos)
        if self.stop():
            return None
        learner, losses = _improve(self._learner, found, self._sizes, self._rates, now, key)
        return learner, found, losses
