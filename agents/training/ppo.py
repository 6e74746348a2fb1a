"""Proximal policy optimisation (Schulman et al. 2017) in JAX.

One update: `rollout` steps the environments, `advantages` judges what they did, `improve` takes
gradient steps over minibatches of it. All that learning goes on from is a `Learner`; the
environments stand in `Progress` beside it. The trainer loops around these pure functions.

An action is mean(obs) + noise * normal numbers, and its probability is that of this sum; the
environment clips it to [-1, 1]. So ratios of probabilities are exact where the clipping acts, too.
The noise follows a schedule: learnt, it vanishes before anything walks, since standing still is a
safe local optimum (it takes a large torque at the right phase to get over the first step).
Where the parameters have a cost_limit, PPO-Lagrangian (Ray, Achiam, Amodei 2019): the reward r of a
step becomes (r - m c) / (1 + m), of which the critic learns the value; after each update the log of
the multiplier m > 0 moves by the violation of the limit. The cost is that of the noisy actions.
Observations are normalised by mean and variance of all that were seen before a rollout: acting and
learning use the same numbers, which change between updates only.
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax

from stickslip.agents.policy.network import MLPPolicy
from stickslip.agents.training.configuration import Configuration
from stickslip.agents.training.trainer import ModelState, Trainer, Update, arrays_of, filled
from stickslip.envs.collecting import Collected, Progress, begin, collect
from stickslip.envs.functional import AnyEnv, abstract_step, horizon

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float

LEAST_SCALE, OBSERVATION_CLIP = 1e-2, 10.0
"""Least scale and clip of a normalised observation's entry."""
KEPT = ("obs", "action", "next_obs")
"""Kept data of each step of a rollout."""
VALUE_WEIGHT = 0.5
"""Weight of the value's squared error in the loss."""
STEEPEST = 0.5
"""Length to which a gradient is shortened."""
OPTIMISER = optax.chain(optax.clip_by_global_norm(STEEPEST), optax.scale_by_adam(eps=1e-5))
LOSSES = ("policy_loss", "value_loss", "kl_divergence", "clip_fraction", "explained_variance")
COST = "cost"
"""The entry of info that a cost limit is about."""
FIRST_MULTIPLIER = 0.1
"""The multiplier at the beginning, when a policy has to learn to move before it learns to be safe:
where falls are dear from the first step on, it learns to stand."""
ASCENT = 0.025
"""Most that the multiplier's log changes in an update: at no cost, or twice the limit and more."""


class Sizes(NamedTuple):
    """Static choices, by the names of a configuration: the shapes of a program."""

    num_envs: int
    rollout_steps: int
    batch_size: int
    epochs: int
    hidden: int
    layers: int = 2

    @property
    def samples(self) -> int:
        """Steps an update."""
        return self.num_envs * self.rollout_steps


class Rates(NamedTuple):
    """Numbers that do not change the compiled program, by the names of a configuration.

    The learning rate goes linearly from its first to its last value, the noise geometrically.
    """

    learning_rate: float = 1e-3
    final_learning_rate: float = 1e-4
    noise: float = 0.22
    final_noise: float = 0.03
    discount: float = 0.99
    gae_lambda: float = 0.95
    clip_range: float = 0.2

    def at(self, share: Float[Array, ""]) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """Learning rate and noise; share: of the training done so far, 0 to 1."""
        share = jnp.clip(share, 0.0, 1.0)
        rates = self.learning_rate, self.final_learning_rate
        noises = jnp.log(self.noise), jnp.log(self.final_noise)
        rate, noise = (first + (last - first) * share for first, last in (rates, noises))
        return rate, jnp.exp(noise)


def settings_of(config: Configuration) -> tuple[Sizes, Rates]:
    """Settings of a training configuration."""
    given = vars(config)
    sizes, rates = ([given[one] for one in kind._fields] for kind in (Sizes, Rates))
    return Sizes(*sizes), Rates(*rates)


Layers = tuple[tuple["Array", "Array"], ...]
"""Weights [inputs, outputs] and biases [outputs] of each layer."""


class Moments(NamedTuple):
    """Mean, variance and number of all observations so far."""

    mean: Float[Array, " obs"]
    variance: Float[Array, " obs"]
    number: Float[Array, ""]


def add_moments(seen: Moments, obs: Float[Array, "samples obs"]) -> Moments:
    """Moments of the observations so far and of these."""
    number = seen.number + len(obs)
    share = len(obs) / number
    mean, variance = obs.mean(0), obs.var(0)
    difference = mean - seen.mean
    spread = (1 - share) * seen.variance + share * variance
    spread = spread + share * (1 - share) * difference**2
    return Moments(seen.mean + share * difference, spread, number)


def _layers(key: Array, widths: tuple[int, ...], last: float) -> Layers:
    """Orthogonal weights with gain sqrt(2), `last` in the last layer; no biases."""
    gains = [*[2**0.5] * (len(widths) - 2), last]
    keys = jax.random.split(key, len(gains))
    shapes, orthogonal = itertools.pairwise(widths), jax.nn.initializers.orthogonal
    return tuple(
        (orthogonal(gain)(key, shape, jnp.float32), jnp.zeros(shape[1], jnp.float32))
        for gain, key, shape in zip(gains, keys, shapes, strict=True)
    )


def network(layers: Layers, seen: Moments) -> MLPPolicy:
    """The perceptron of these layers, observations normalised."""
    scale = jnp.maximum(jnp.sqrt(seen.variance), LEAST_SCALE)
    weights, biases = zip(*layers, strict=True)
    return MLPPolicy(weights, biases, seen.mean, scale, observation_clip=OBSERVATION_CLIP)


def begin_episodes(
    env: AnyEnv, params: Any, sizes: Sizes, seed: Array | int
) -> tuple[Progress[Any], Array]:
    """Fresh episodes, and the key of the updates: update i uses fold_in(key, i)."""
    episodes, updates = jax.random.split(jax.random.fold_in(jax.random.key(seed), 1))
    return begin(env, sizes.num_envs, params, episodes), updates


class Learner(NamedTuple):
    """All that learning goes on from."""

    actor: Layers
    critic: Layers
    optimiser: optax.OptState
    """State of `OPTIMISER` over (actor, critic)."""
    seen: Moments
    multiplier: Float[Array, ""] | None = None
    """Log of the cost's multiplier; None without a limit."""


class Batch(NamedTuple):
    """Samples to learn from, every entry [samples, ...]."""

    obs: Array
    action: Array
    log_probability: Array
    """Log-probability of the action when it was chosen."""
    advantage: Array
    value: Array
    """Target of the critic: its old estimate plus the advantage."""


@partial(jax.jit, static_argnums=(0, 1, 2))
def begin_learning(inputs: int, outputs: int, sizes: Sizes, key: Array) -> Learner:
    """Initialise the learner for `inputs` observed numbers, which it leaves as they are, and
    `outputs` actions; the actor's last layer is small."""
    actor, critic = jax.random.split(key)
    inner = (inputs, *[sizes.hidden] * sizes.layers)
    networks = _layers(actor, (*inner, outputs), 0.01), _layers(critic, (*inner, 1), 1.0)
    zero = jnp.zeros(inputs, jnp.float32)
    seen = Moments(zero, zero + 1, jnp.zeros((), jnp.float32))
    return Learner(*networks, OPTIMISER.init(networks), seen)


def explore(given: tuple[MLPPolicy, Array], obs: Float[Array, " obs"], key: Array):
    """An action drawn around the policy's; given: the policy and the noise."""
    policy, noise = given
    mean = policy.unlimited(obs)
    return mean + noise * jax.random.normal(key, mean.shape, mean.dtype)


def rollout(
    env: AnyEnv,
    params: Any,
    sizes: Sizes,
    noise: Array,
    learner: Learner,
    progress: Progress[Any],
    keep: tuple[str, ...] = (),
) -> Collected[Any]:
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


def constrained_reward(learner: Learner, found: Collected) -> Float[Array, "steps n"]:
    """The reward less the cost by its multiplier, on the reward's scale."""
    if learner.multiplier is None:
        return found.reward
    weight = jnp.exp(learner.multiplier)
    return (found.reward - weight * found.kept[COST]) / (1 + weight)


def raised(multiplier: Array, cost: Array, limit: Array | float) -> Float[Array, ""]:
    """The log of the multiplier after a step of dual ascent on the relative violation."""
    violation = (cost - limit) / jnp.maximum(limit, 1e-9)
    return multiplier + ASCENT * jnp.clip(violation, -1.0, 1.0)


def samples_of(learner: Learner, found: Collected, noise: Array, rates: Rates) -> Batch:
    """Samples of a rollout for the update."""
    obs, action = found.kept["obs"], found.kept["action"]
    critic = network(learner.critic, learner.seen)
    value, later = (critic.unlimited(found.kept[of])[..., 0] for of in ("obs", "next_obs"))
    ends = found.terminated, found.truncated
    reward = constrained_reward(learner, found)
    gain = advantages(reward, *ends, value, later, rates.discount, rates.gae_lambda)
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


@partial(jax.jit, static_argnums=2)
def improve(
    learner: Learner,
    found: Collected,
    sizes: Sizes,
    rates: Rates,
    now: tuple[Array, Array],
    key: Array,
    limit: Array | float | None = None,
) -> tuple[Learner, dict[str, Array]]:
    """The learner after gradient steps over a rollout, and means over them by `LOSSES`.

    now: learning rate and noise. limit: of a step's mean cost, for a learner with a multiplier.
    """
    rate, noise = now
    every = samples_of(learner, found, noise, rates)
    samples, size = sizes.samples, sizes.batch_size

    def step(carry: tuple[Any, optax.OptState], rows: Array):
        networks, optimiser = carry
        batch = jax.tree.map(lambda leaf: leaf[rows], every)
        given = networks, learner.seen, batch, noise, rates.clip_range
        gradient, about = jax.grad(loss_of, has_aux=True)(*given)
        change, optimiser = OPTIMISER.update(gradient, optimiser)
        networks = jax.tree.map(lambda one, by: one - rate * by, networks, change)
        return (networks, optimiser), about

    def epoch(carry: tuple[Any, optax.OptState], first: Array):
        return jax.lax.scan(step, carry, jnp.roll(order, first).reshape(-1, size))

    shuffling, beginning = jax.random.split(key)
    order = jnp.argsort(jax.random.bits(shuffling, (samples,)))  # sorting takes as long as an epoch
    firsts = jax.random.randint(beginning, (sizes.epochs,), 0, samples)
    start = (learner.actor, learner.critic), learner.optimiser
    ((actor, critic), optimiser), about = jax.lax.scan(epoch, start, firsts)
    losses = {name: values.mean() for name, values in about.items()}
    error = jnp.var(every.advantage) / jnp.maximum(jnp.var(every.value), 1e-12)
    losses["explained_variance"] = 1 - error
    multiplier = learner.multiplier
    if multiplier is not None and limit is not None:
        losses |= {COST: found.kept[COST].mean(), "multiplier": jnp.exp(multiplier)}
        multiplier = raised(multiplier, losses[COST], limit)
    seen = add_moments(learner.seen, every.obs)
    return Learner(actor, critic, optimiser, seen, multiplier), losses


class PPOTrainer(Trainer):
    """Learns in JAX on whichever platform it finds. `stop` is asked twice an update."""

    losses = LOSSES

    def build(self) -> None:
        env: Any = self.env  # every step of a rollout is to be one of an episode
        self.env, seed = replace(env, autoreset="same_step"), self.config.seed
        self._sizes, self._rates = settings_of(self.config)
        obs, _, step = abstract_step(self.env, self.params)
        info = {name: one for name, one in step[5].items() if name != "autoreset"}
        self._infos = tuple(name for name, one in info.items() if one.ndim == 0)
        given = obs.shape[-1], len(self.env.action_names), self._sizes, jax.random.key(seed)
        self._learner: Learner = begin_learning(*given)
        limit = getattr(self.params, "cost_limit", None)
        self._limit = None if limit is None else float(limit) / horizon(self.params)
        if self._limit is not None:
            multiplier = jnp.log(jnp.float32(FIRST_MULTIPLIER))
            self._learner = self._learner._replace(multiplier=multiplier)
            self.losses = (*LOSSES, COST, "multiplier")
        self._progress, self._key = begin_episodes(self.env, self.params, self._sizes, seed)

    def advance(self, goal: int) -> None:
        while self.timesteps < goal and not self.stopped:
            self._update()

    def _update(self) -> None:
        """One update; none where it is stopped."""
        now = self._rates.at(jnp.float32(self.timesteps / self.config.timesteps))
        key = jax.random.fold_in(self._key, self.timesteps // self._sizes.samples)
        given = self.env, self.params, self._sizes, now[1], self._learner, self._progress
        found = rollout(*given, self._infos)
        self.stopped = self.stop()
        if self.stopped:
            return
        given = self._learner, found, self._sizes, self._rates, now, key, self._limit
        learner, losses = jax.block_until_ready(improve(*given))
        self.stopped = self.stop()
        if self.stopped:
            return
        over = np.asarray(found.terminated | found.truncated)
        ended = {name: np.asarray(found.kept[name])[over] for name in self._infos}
        self._learner, self._progress = learner, found.progress
        self.timesteps += self._sizes.samples
        losses = {name: float(losses[name]) for name in self.losses}
        rate, noise = map(float, now)
        self.report(Update(self.timesteps, rate, noise, ended if over.any() else {}, losses))

    def take_state(self) -> ModelState:
        return arrays_of({"learner": self._learner, "episodes": self._progress})

    def put_state(self, state: ModelState) -> None:
        found = filled({"learner": self._learner, "episodes": self._progress}, state)
        self._learner, self._progress = found["learner"], found["episodes"]

    def network(self) -> MLPPolicy:
        return network(self._learner.actor, self._learner.seen)

    def is_finite(self) -> bool:
        return all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(self._learner))
