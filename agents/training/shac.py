"""Short-horizon actor-critic (Xu et al. 2022, SHAC) in JAX.

One update: the environments are stepped over a short window, and the actor follows the derivative,
through the simulator, of the rewards in it and of a critic's value at its end. The critic learns
the TD(lambda) values of the window's observations; a slowly following copy of it is what the actor
sees. Where PPO learns from what chance found, this learns from slopes: `docs/use.md` says
where they mislead.

An action is tanh(mean(obs)) + noise * normal numbers, clipped to [-1, 1]; the normal numbers are
drawn beforehand, so the action has a derivative by the mean wherever it is not clipped.

What carries no derivative: a reset, the reward of a step that terminates, and any step of one
environment whose derivatives are not all finite (at a grazing onset there is no bound on them).
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax

from stickslip.agents.protocol import Params, State
from stickslip.agents.training.ppo import flattened, judged
from stickslip.agents.training.trainer import (
    JAXTrainer,
    Layers,
    Moments,
    Rates,
    Sizes,
    actor_and_critic,
    add_moments,
    network,
    no_moments,
)
from stickslip.dynamics.kernels.fused import fused, where_needed
from stickslip.envs.collecting import Collected, Progress

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.agents.policy.network import MLPPolicy
    from stickslip.agents.training.trainer import Now
    from stickslip.envs.functional import FunctionalEnv

    Leaves = list[Array | None]
    Stepped = tuple[Array, State, Array, Array, Array, dict[str, Array]]


STEEPEST = 1.0
"""Length to which a gradient is shortened, the actor's and the critic's."""
LONGEST = 1e3
"""Length to which what a step hands back to the step before it is shortened."""
KEY = jax.eval_shape(lambda: jax.random.key(0))
"""The shape of a random key."""
OPTIMISER = optax.chain(optax.clip_by_global_norm(STEEPEST), optax.scale_by_adam(b1=0.7, b2=0.95))
"""Optimiser of short memory, as the problem changes with every update."""
LOSSES = ("actor_loss", "value_loss", "gradient_length", "explained_variance")


class ShortLearner(NamedTuple):
    """All that learning goes on from."""

    actor: Layers
    critic: Layers
    target: Layers
    """Follows the critic."""
    optimisers: tuple[optax.OptState, optax.OptState]
    """States of `OPTIMISER` over the actor and over the critic."""
    seen: Moments


def begin_learning(inputs: int, outputs: int, sizes: Sizes, key: Array) -> ShortLearner:
    """Initialise the learner for `inputs` observed numbers and `outputs` actions."""
    acting, judging = actor_and_critic(inputs, outputs, sizes, key)
    optimisers = OPTIMISER.init(acting), OPTIMISER.init(judging)
    return ShortLearner(acting, judging, judging, optimisers, no_moments(inputs))


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def slope_step(
    env: FunctionalEnv[State, Params], state: State, action: Array, params: Params
) -> Stepped[State]:
    """`env.step_env` with the derivative of observation, state and reward by state and action,
    made fit for long chains.

    Back through a step is one kernel, too, which computes the step again. A derivative that is not
    finite is 0, so the chain ends there for this environment alone.
    """
    return fused_step(env, state, action, params)


@partial(fused, fixed=1)
def fused_step(env: FunctionalEnv[State, Params], state: State, action: Array, params: Params):
    """`env.step_env` as one kernel."""
    return env.step_env(state, action, params)


def _forward(env: FunctionalEnv[State, Params], state: State, action: Array, params: Params):
    return fused_step(env, state, action, params), (state, action, params)


def _backward(
    env: FunctionalEnv[State, Params], saved: tuple[State, Array, Params], given: Stepped[State]
):
    state, action, params = saved
    numbers, whole = _split(state)
    pushed = given[0], _split(given[1])[0], given[2]
    found = _cotangents(env, numbers, whole, action, params, pushed)
    length = _norm(found)
    factor = jnp.minimum(1.0, LONGEST / jnp.maximum(length, 1e-12))
    slopes, by_action = jax.tree.map(
        lambda leaf: jnp.where(jnp.isfinite(length), leaf * factor, 0.0), found
    )
    none = [None if leaf is None else np.zeros(leaf.shape, jax.dtypes.float0) for leaf in whole]
    every = [rest if slope is None else slope for slope, rest in zip(slopes, none, strict=True)]
    return jax.tree.unflatten(jax.tree.structure(state), every), by_action, None


@partial(fused, fixed=1)
def _cotangents(
    env: FunctionalEnv[State, Params],
    numbers: Leaves,
    whole: Leaves,
    action: Array,
    params: Params,
    given: tuple[Array, Leaves, Array],
) -> tuple[Leaves, Array]:
    """Cotangents of a step's state and action.

    numbers, whole: the state's leaves that have derivatives, and the others.
    """
    structure = jax.tree.structure(jax.eval_shape(lambda key: env.reset_env(key, params)[1], KEY))

    def step(numbers: Leaves, action: Array):
        leaves = [rest if one is None else one for one, rest in zip(numbers, whole, strict=True)]
        state = jax.tree.unflatten(structure, leaves)
        obs, after, reward = env.step_env(state, action, params)[:3]
        return obs, _split(after)[0], reward

    return jax.vjp(step, numbers, action)[1](given)


def _norm(tree: object) -> Array:
    return jnp.sqrt(sum(jnp.sum(leaf**2) for leaf in jax.tree.leaves(tree)))


def _split(tree: object) -> tuple[Leaves, Leaves]:
    """The leaves that have derivatives, and the others, with None in the places of the rest."""
    leaves = jax.tree.leaves(tree)
    is_number = [
        leaf.dtype != jax.dtypes.float0 and jnp.issubdtype(leaf.dtype, jnp.floating)
        for leaf in leaves
    ]
    pairs = list(zip(leaves, is_number, strict=True))
    return [one if number else None for one, number in pairs], [
        None if number else one for one, number in pairs
    ]


slope_step.defvjp(_forward, _backward)


def window(
    env: FunctionalEnv[State, Params],
    params: Params,
    sizes: Sizes,
    noise: Array,
    policy: MLPPolicy,
    critic: MLPPolicy,
    discount: Array | float,
    progress: Progress[State],
    keep: tuple[str, ...],
) -> tuple[Array, tuple[Array, Array, Array, dict[str, Array]], Progress[State]]:
    """One environment's window: what it earns, discounted from its start or from the episode's that
    begins in it, with the critic's value where it is cut off; what happened, as in Collected; and
    where it stands."""

    def step(carry: tuple[Progress[State], Array], last: Array):
        now, weight = carry
        draws = jax.random.split(jax.random.wrap_key_data(now.keys), 3)
        mean = policy(now.obs)
        action = mean + noise * jax.random.normal(draws[1], mean.shape, mean.dtype)
        stepped: Stepped[State] = slope_step(env, now.state, jnp.clip(action, -1.0, 1.0), params)
        obs, state, reward, terminated, truncated, info = stepped
        over = terminated | truncated
        worth = jnp.where(terminated, jax.lax.stop_gradient(reward), reward)
        later = jnp.where(terminated, 0.0, critic.unlimited(obs)[0])
        earned = weight * (worth + jnp.where(over | last, discount * later, 0.0))
        kept = {"obs": now.obs, "next_obs": obs, **{name: info[name] for name in keep}}
        old = jax.lax.stop_gradient((obs, state))
        fresh = where_needed(over, env.reset_env, (draws[2], params), old)
        obs, state = jax.tree.map(partial(jnp.where, over), fresh, (obs, state))
        after = Progress(state, obs, jax.random.key_data(draws[0]))
        weight = jnp.where(over, 1.0, weight * discount)
        return (after, weight), (earned, (reward, terminated, truncated, kept))

    last = jnp.arange(sizes.rollout_steps) == sizes.rollout_steps - 1
    (after, _), (earned, rows) = jax.lax.scan(step, (progress, jnp.ones(())), last)
    return earned.sum(), rows, after


def actor_loss(
    actor: Layers,
    learner: ShortLearner,
    env: FunctionalEnv[State, Params],
    params: Params,
    sizes: Sizes,
    noise: Array,
    discount: Array | float,
    progress: Progress[State],
    keep: tuple[str, ...] = (),
) -> tuple[Array, Collected[State]]:
    """Minus what a step earns in the mean over all windows, and what happened in them."""
    policy = network(actor, learner.seen, squash="tanh")
    critic = network(learner.target, learner.seen)
    one = partial(window, env, params, sizes, noise, policy, critic, discount, keep=keep)
    # the axis of the environments in what comes back: behind the steps, and first in what goes on
    earned, rows, after = jax.vmap(one, out_axes=(0, 1, 0))(progress)
    return -earned.mean() / sizes.rollout_steps, Collected(*rows, after)


def improve(
    env: FunctionalEnv[State, Params],
    params: Params,
    sizes: Sizes,
    rates: Rates,
    now: Now,
    learner: ShortLearner,
    progress: Progress[State],
    key: Array,
    keep: tuple[str, ...] = (),
) -> tuple[ShortLearner, Collected[State], dict[str, Array]]:
    """One update: the learner after it, what happened in the windows, and values by `LOSSES`."""
    (loss, found), gradient = jax.value_and_grad(actor_loss, has_aux=True)(
        learner.actor, learner, env, params, sizes, now.noise, rates.discount, progress, keep
    )
    length = _norm(gradient)
    gradient = jax.tree.map(lambda leaf: jnp.where(jnp.isfinite(length), leaf, 0.0), gradient)
    actor, own = _apply(learner.actor, gradient, learner.optimisers[0], now.learning_rate)
    judgement = judged(network(learner.target, learner.seen), found, rates)
    obs, (advantage, values) = flattened((found.kept["obs"], judgement))
    pace = now.learning_rate * rates.critic_pace
    critic, theirs, error = _fit_critic(learner, obs, values, sizes, pace, key)
    target = jax.tree.map(
        lambda old, new: rates.target_memory * old + (1 - rates.target_memory) * new,
        learner.target,
        critic,
    )
    unexplained = jnp.var(advantage) / jnp.maximum(jnp.var(values), 1e-12)
    values_of = loss, error, length, 1 - unexplained
    losses: dict[str, Array] = dict(zip(map(str, LOSSES), values_of, strict=True))
    after = ShortLearner(actor, critic, target, (own, theirs), add_moments(learner.seen, obs))
    return after, found, losses


def _apply(layers: Layers, gradient: Layers, state: optax.OptState, rate: Array):
    change, state = OPTIMISER.update(gradient, state)
    return jax.tree.map(lambda one, by: one - rate * by, layers, change), state


def _fit_critic(
    learner: ShortLearner,
    obs: Array,
    values: Array,
    sizes: Sizes,
    rate: Array,
    key: Array,
) -> tuple[Layers, optax.OptState, Array]:
    """The critic after passes over the samples in minibatches, and its mean squared error."""

    def error_of(layers: Layers, rows: Array) -> Array:
        said = network(layers, learner.seen).unlimited(obs[rows])[..., 0]
        return ((said - values[rows]) ** 2).mean()

    def step(carry: tuple[Layers, optax.OptState], rows: Array):
        error, gradient = jax.value_and_grad(error_of)(carry[0], rows)
        return _apply(carry[0], gradient, carry[1], rate), error

    def epoch(carry: tuple[Layers, optax.OptState], key: Array):
        order = jnp.argsort(jax.random.bits(key, (sizes.samples,)))
        return jax.lax.scan(step, carry, order.reshape(-1, sizes.batch_size))

    start = learner.critic, learner.optimisers[1]
    (critic, state), errors = jax.lax.scan(epoch, start, jax.random.split(key, sizes.epochs))
    return critic, state, errors.mean()


def policy_of(learner: ShortLearner) -> MLPPolicy:
    """The actor, without exploration."""
    return network(learner.actor, learner.seen, squash="tanh")


_improve = jax.jit(improve, static_argnums=(0, 2, 8))


class SHACTrainer(JAXTrainer[ShortLearner, State, Params]):
    """Learns from derivatives through the environment's step, which has to have them. `stop` is
    asked after every update."""

    losses = LOSSES
    first_learner = staticmethod(jax.jit(begin_learning, static_argnums=(0, 1, 2)))
    network_of = staticmethod(policy_of)

    def learnt(
        self, now: Now, key: Array
    ) -> tuple[ShortLearner, Collected[State], dict[str, Array]] | None:
        """See JAXTrainer."""
        given = self.env, self.params, self._sizes, self._rates, now, self._learner
        return _improve(*given, self._progress, key, self._infos)
