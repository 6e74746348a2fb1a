"""What learning in JAX begins with: networks, moments of observations, episodes, devices.

Observations are normalised by mean and variance of all that were seen before a rollout: acting and
learning use the same numbers, which change between updates only.

A mesh of devices has one axis, along which environments and samples are divided; parameters lie on
each device. Where one device learns there is no mesh (None), and arrays stay as they are.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from stickslip.agents.policy.network import MLPPolicy
from stickslip.dynamics.checks import as_number, require_integer
from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs.collecting import Progress, begin

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.envs.functional import FunctionalEnv, Params, State


LEAST = {"rollout_steps": 2, "batch_size": 2}
MOST = {"num_envs": 65536, "epochs": 10_000, "hidden": 4096, "layers": 8}
"""As in a machine's configuration."""
POSITIVE = ("learning_rate", "noise", "final_noise", "clip_range")
SHARES = ("discount", "gae_lambda")


@dataclass(frozen=True)
class Sizes:
    """Static choices: the shapes of a program. `settings_of` takes a machine's configuration."""

    num_envs: int = 1024
    rollout_steps: int = 32
    """Of each environment, an update."""
    batch_size: int = 4096
    """Samples a gradient step; divides num_envs x rollout_steps."""
    epochs: int = 4
    """Passes over a rollout."""
    hidden: int = 64
    """Units a hidden layer, of the actor and of the critic."""
    layers: int = 2

    def __post_init__(self):
        for one in fields(self):
            low, high = LEAST.get(one.name, 1), MOST.get(one.name, 2**53)
            require_integer(one.name, getattr(self, one.name), low=low, high=high)
        if self.samples % self.batch_size:
            raise ValueError(
                f"batch_size = {self.batch_size} is not accepted; accepted: a divisor of num_envs "
                f"x rollout_steps = {self.samples}"
            )

    @property
    def samples(self) -> int:
        """Steps an update."""
        return self.num_envs * self.rollout_steps


class Now(NamedTuple):
    """Numbers that change during training."""

    learning_rate: Float[Array, ""]
    noise: Float[Array, ""]


@register_pytree
@dataclass(frozen=True)
class Rates:
    """Numbers, which compile nothing again: each may be an array of a population's [members].

    The learning rate goes linearly from its first to its last value, the noise geometrically.
    """

    learning_rate: Float[Array, ""] | float = 1e-3
    final_learning_rate: Float[Array, ""] | float = 1e-4
    noise: Float[Array, ""] | float = 0.22
    """Standard deviation of exploration, the largest action being 1."""
    final_noise: Float[Array, ""] | float = 0.03
    discount: Float[Array, ""] | float = 0.99
    """Of rewards, per control step."""
    gae_lambda: Float[Array, ""] | float = 0.95
    clip_range: Float[Array, ""] | float = 0.2

    def at(self, share: Float[Array, ""]) -> Now:
        """share: of the training done so far, 0 to 1."""
        share = jnp.clip(share, 0.0, 1.0)
        rates, noises = (
            (self.learning_rate, self.final_learning_rate),
            (jnp.log(self.noise), jnp.log(self.final_noise)),
        )
        rate, noise = (first + (last - first) * share for first, last in (rates, noises))
        return Now(rate, jnp.exp(noise))

    def validate(self) -> Rates:
        """These with lists as arrays, or ValueError naming what is no such number."""
        found = {}
        for one in fields(self):
            strict, high = one.name in POSITIVE, 1.0 if one.name in SHARES else math.inf
            accepted = "0 to 1" if one.name in SHARES else f"finite, {'>' if strict else '>='} 0"
            rule = {"low": 0.0, "strict": strict, "high": high, "accepted": accepted}
            found[one.name] = as_number(one.name, getattr(self, one.name), **rule)
        return replace(self, **found)


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


AXIS = "environments"
COPIED = PartitionSpec()
SPREAD, SPREAD_STEPS = PartitionSpec(AXIS), PartitionSpec(None, AXIS)
"""Of arrays [n, ...] and [steps, n, ...]."""
HOW_MORE = "on a processor XLA_FLAGS=--xla_force_host_platform_device_count=N makes N devices of it"

Tree = TypeVar("Tree")


def mesh_for(devices: int | None, *divided: int) -> Mesh | None:
    """The mesh of so many devices of this process; None for one.

    devices: default: as many as divide evenly what is to be divided, of those that there are.
    divided: numbers of environments, of samples. ValueError for more devices than there are, and
    for what they do not divide.
    """
    here = jax.local_device_count()
    if devices is None:
        common = math.gcd(*divided)
        devices = next(one for one in range(here, 0, -1) if common % one == 0)
    most = f"1 to {here}, the devices of this process ({HOW_MORE})"
    devices = require_integer("devices", devices, high=here, accepted=most)
    if bad := [one for one in divided if one % devices]:
        raise ValueError(
            f"devices = {devices} do not divide {bad[0]}; accepted: devices that divide num_envs "
            f"and batch_size = {', '.join(map(str, divided))} evenly"
        )
    return None if devices == 1 else Mesh(np.asarray(jax.local_devices()[:devices]), (AXIS,))


def laid(mesh: Mesh | None, tree: Tree, how: PartitionSpec) -> Tree:
    """Inside a trace: the arrays divided or copied, whatever they were."""
    if mesh is None:
        return tree
    return jax.lax.with_sharding_constraint(tree, NamedSharding(mesh, how))


def put(mesh: Mesh | None, tree: Tree, how: PartitionSpec) -> Tree:
    """Outside of a trace: the arrays divided or copied over the mesh."""
    return tree if mesh is None else jax.device_put(tree, NamedSharding(mesh, how))


def fetched(tree: Tree) -> Tree:
    """The arrays as NumPy's, whole; random keys as plain numbers."""

    def one(leaf: Array) -> np.ndarray:
        return np.asarray(jax.random.key_data(leaf) if is_key(leaf) else leaf)

    return jax.tree.map(one, tree)


def is_key(leaf: object) -> bool:
    """Whether these are random keys, as JAX types them."""
    return isinstance(leaf, jax.Array) and jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key)
