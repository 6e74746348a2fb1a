"""Trainers: the interface between a run and what learns, and what those in JAX share.

A trainer learns, reports, and gives out its policy and its state. Checkpoints, metrics,
evaluations, progress and resumption stand outside it and serve every trainer.

In JAX, observations are normalised by mean and variance of all that were seen before a rollout:
acting and learning use the same numbers, which change between updates only.
"""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple, TypeAlias, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.policy.network import MLPPolicy
from stickslip.agents.protocol import Params, State
from stickslip.agents.training.configuration import Config, Configuration
from stickslip.dynamics.checks import shown
from stickslip.envs.collecting import Progress, begin

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from jaxtyping import Array, Float

    from stickslip.envs.collecting import Collected
    from stickslip.envs.functional import FunctionalEnv

ModelState: TypeAlias = "Mapping[str, np.ndarray | str | int]"
"""All that learning goes on from."""
Tree = TypeVar("Tree")
Settings = TypeVar("Settings", "Sizes", "Rates")
Learner = TypeVar("Learner")
"""All that learning goes on from: a tree of arrays."""
LEAST_SCALE, OBSERVATION_CLIP = 1e-2, 10.0
"""Least scale and clip of a normalised observation's entry."""
UNFIT = "its contents do not fit the configuration"


class Update(NamedTuple):
    """Report of the learning since the last one."""

    timesteps: int
    """So far."""
    learning_rate: float
    noise: float
    """Standard deviation of exploration; NaN where there is no such number."""
    ended: Mapping[str, np.ndarray]
    """Last infos of the episodes that ended, each [episodes]; {} without any."""
    losses: Mapping[str, float]
    """Losses by the names of `losses`; some may be missing."""


class Trainer(ABC, Generic[Config, State, Params]):
    """Something that learns a policy.

    From one `begin_stretch` to the next it depends on nothing but its state, the seed and the
    number of steps so far: so a run that was killed goes on as if it had not been.
    """

    losses: tuple[str, ...]
    """Columns of metrics.csv that are the trainer's own."""

    def __init__(
        self,
        config: Config,
        env: FunctionalEnv[State, Params],
        params: Params,
        report: Callable[[Update], None] = lambda update: None,
        stop: Callable[[], bool] = lambda: False,
    ):
        """env, params: of training episodes. report: called after updates. stop: asked after every
        step, or every few that are one program; once true, learning ends and `stopped` is set.
        """
        self.config, self.env, self.params = config, env, params
        self.report, self.stop = report, stop
        self.timesteps = 0
        """So far; those of an update that `stop` cut short are not counted."""
        self.stopped = False
        self.build()

    @abstractmethod
    def build(self) -> None:
        """Make what learns, from nothing."""

    @abstractmethod
    def begin_stretch(self, timesteps: int) -> None:
        """Restart all random generators and episodes that the state does not hold from the seed and
        the steps so far."""

    @abstractmethod
    def advance(self, goal: int) -> None:
        """Learn until there were at least `goal` steps in all, or until it is stopped."""

    @abstractmethod
    def take_state(self) -> ModelState:
        """All that learning goes on from."""

    @abstractmethod
    def put_state(self, state: ModelState) -> None:
        """Undo `take_state`. ValueError if the state does not fit the configuration."""

    @abstractmethod
    def policy(self) -> MLPPolicy:
        """The policy so far, without exploration."""

    @abstractmethod
    def is_finite(self) -> bool:
        """True if every parameter is."""


class Sizes(NamedTuple):
    """Static choices: the shapes of a program."""

    num_envs: int
    rollout_steps: int
    """Steps of each environment in an update."""
    batch_size: int
    """Samples a gradient step; divides num_envs x rollout_steps."""
    epochs: int
    """Passes over a rollout; of SHAC's critic."""
    hidden: int
    """Units a hidden layer, of the actor and of the critic."""
    layers: int = 2

    @property
    def samples(self) -> int:
        """Steps an update."""
        return self.num_envs * self.rollout_steps


class Now(NamedTuple):
    """Numbers that change during training."""

    learning_rate: Float[Array, ""]
    noise: Float[Array, ""]


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
    critic_pace: float = 1.0
    target_memory: float = 0.2

    def at(self, share: Float[Array, ""]) -> Now:
        """share: of the training done so far, 0 to 1."""
        share = jnp.clip(share, 0.0, 1.0)
        rates = self.learning_rate, self.final_learning_rate
        noises = jnp.log(self.noise), jnp.log(self.final_noise)
        rate, noise = (first + (last - first) * share for first, last in (rates, noises))
        return Now(rate, jnp.exp(noise))


SHORT = {
    "rollout_steps": "horizon",
    "epochs": "critic_passes",
    "noise": "action_noise",
    "final_noise": "final_action_noise",
    "gae_lambda": "td_lambda",
}
"""SHAC's settings in place of PPO's."""


def settings_of(config: Configuration) -> tuple[Sizes, Rates]:
    """Settings of a training configuration."""
    names = SHORT if config.algorithm == "shac" else {}

    def read(kind: type[Settings]) -> Settings:
        return kind(*(getattr(config, names.get(one, one)) for one in kind._fields))

    return read(Sizes), read(Rates)


Layers = tuple[tuple["Array", "Array"], ...]
"""Weights [inputs, outputs] and biases [outputs] of each layer."""


class Moments(NamedTuple):
    """Mean, variance and number of all observations so far."""

    mean: Float[Array, " obs"]
    variance: Float[Array, " obs"]
    number: Float[Array, ""]


def no_moments(inputs: int) -> Moments:
    """Moments before the first observation, which leave it as it is."""
    zero = jnp.zeros(inputs, jnp.float32)
    return Moments(zero, zero + 1, jnp.zeros((), jnp.float32))


def add_moments(seen: Moments, obs: Float[Array, "samples obs"]) -> Moments:
    """Moments of the observations so far and of these."""
    number = seen.number + len(obs)
    share = len(obs) / number
    mean, variance = obs.mean(0), obs.var(0)
    difference = mean - seen.mean
    spread = (1 - share) * seen.variance + share * variance
    spread = spread + share * (1 - share) * difference**2
    return Moments(seen.mean + share * difference, spread, number)


def actor_and_critic(inputs: int, outputs: int, sizes: Sizes, key: Array) -> tuple[Layers, Layers]:
    """Initial layers of both; the actor's last ones are small."""
    actor, critic = jax.random.split(key)
    inner = (inputs, *[sizes.hidden] * sizes.layers)
    return _layers(actor, (*inner, outputs), 0.01), _layers(critic, (*inner, 1), 1.0)


def _layers(key: Array, widths: tuple[int, ...], last: float) -> Layers:
    """Orthogonal weights with gain sqrt(2), `last` in the last layer; no biases."""
    gains = [*[2**0.5] * (len(widths) - 2), last]
    keys = jax.random.split(key, len(gains))
    shapes, orthogonal = itertools.pairwise(widths), jax.nn.initializers.orthogonal
    return tuple(
        (orthogonal(gain)(key, shape, jnp.float32), jnp.zeros(shape[1], jnp.float32))
        for gain, key, shape in zip(gains, keys, shapes, strict=True)
    )


def network(layers: Layers, seen: Moments, squash: str = "clip") -> MLPPolicy:
    """The perceptron of these layers, observations normalised."""
    scale = jnp.maximum(jnp.sqrt(seen.variance), LEAST_SCALE)
    weights, biases = zip(*layers, strict=True)
    return MLPPolicy(
        weights, biases, seen.mean, scale, squash=squash, observation_clip=OBSERVATION_CLIP
    )


def begin_episodes(
    env: FunctionalEnv[State, Params], params: Params, sizes: Sizes, seed: Array | int
) -> tuple[Progress[State], Array]:
    """Fresh episodes, and the key of the updates: update i uses fold_in(key, i)."""
    episodes, updates = jax.random.split(jax.random.fold_in(jax.random.key(seed), 1))
    return begin(env, sizes.num_envs, params, episodes), updates


class JAXTrainer(Trainer[Configuration, State, Params], Generic[Learner, State, Params]):
    """Learns in JAX on whichever platform it finds, by the functions of a subclass."""

    first_learner: ClassVar[staticmethod[[int, int, Sizes, Array], Any]]
    """First learner from `inputs` observed numbers, `outputs` actions, sizes and a key."""
    network_of: ClassVar[staticmethod[[Any], MLPPolicy]]
    """Policy of a learner."""

    def build(self) -> None:
        """See Trainer."""
        env: Any = self.env  # every step of a rollout is to be one of an episode
        self.env, seed = replace(env, autoreset="same_step"), self.config.seed
        self._sizes, self._rates = settings_of(self.config)
        inputs, self._infos = shapes_of(self.env, self.params)
        given = inputs, len(self.env.action_names), self._sizes, jax.random.key(seed)
        self._learner: Learner = self.first_learner(*given)
        self._progress, self._key = begin_episodes(self.env, self.params, self._sizes, seed)

    @abstractmethod
    def learnt(
        self, now: Now, key: Array
    ) -> tuple[Learner, Collected[State], Mapping[str, Array]] | None:
        """The learner after an update, its rollout and losses; None where it was stopped."""

    def begin_stretch(self, timesteps: int) -> None:
        """See Trainer. Episodes and random numbers are in the state, so they go on."""
        self.timesteps = timesteps

    def advance(self, goal: int) -> None:
        """See Trainer."""
        while self.timesteps < goal and not self.stopped:
            self._update()

    def _update(self) -> None:
        """One update; none where it is stopped."""
        now = self._rates.at(jnp.float32(self.timesteps / self.config.timesteps))
        key = jax.random.fold_in(self._key, self.timesteps // self._sizes.samples)
        learnt = jax.block_until_ready(self.learnt(now, key))
        self.stopped = learnt is None or self.stop()
        if learnt is None or self.stopped:
            return
        self._learner, found, losses = learnt
        self._progress = found.progress
        self.timesteps += self._sizes.samples
        self.report(
            Update(
                timesteps=self.timesteps,
                learning_rate=float(now.learning_rate),
                noise=float(now.noise),
                ended=ended_in(found, self._infos),
                losses={name: float(losses[name]) for name in self.losses},
            )
        )

    @property
    def _state(self) -> dict[str, Any]:
        return {"learner": self._learner, "episodes": self._progress}

    def take_state(self) -> ModelState:
        """See Trainer."""
        return _named(self._state)

    def put_state(self, state: ModelState) -> None:
        """See Trainer."""
        filled = _filled(self._state, state)
        self._learner, self._progress = filled["learner"], filled["episodes"]

    def policy(self) -> MLPPolicy:
        """See Trainer."""
        return self.network_of(self._learner).validate()

    def is_finite(self) -> bool:
        """See Trainer."""
        return all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(self._learner))


def shapes_of(env: FunctionalEnv[State, Params], params: Params) -> tuple[int, tuple[str, ...]]:
    """Size of an observation, and the names of the numbers in info."""

    def first(key: Array) -> tuple[Array, dict[str, Array]]:
        obs, state = env.reset_env(key, params)
        info = env.step_env(state, jnp.zeros(len(env.action_names)), params)[5]
        return obs, {name: value for name, value in info.items() if jnp.ndim(value) == 0}

    obs, info = jax.eval_shape(first, jax.random.key(0))
    return obs.shape[-1], tuple(info)


def ended_in(found: Collected, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Last infos of the episodes that ended in a rollout; {} without any."""
    over = np.asarray(found.terminated) | np.asarray(found.truncated)
    return {name: np.asarray(found.kept[name])[over] for name in names} if over.any() else {}


def _named(tree: object) -> dict[str, np.ndarray]:
    """A tree's arrays by their paths; random keys as plain numbers."""
    leaves = jax.tree.leaves_with_path(tree)
    return {jax.tree_util.keystr(path): _plain(leaf) for path, leaf in leaves}


def _plain(leaf: Array) -> np.ndarray:
    return np.asarray(jax.random.key_data(leaf) if _is_key(leaf) else leaf)


def _is_key(leaf: object) -> bool:
    return isinstance(leaf, jax.Array) and jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key)


def _filled(tree: Tree, given: Mapping[str, object]) -> Tree:
    """The tree with the arrays that `_named` gave. ValueError for those of another tree."""
    mine, leaves = _named(tree), jax.tree.leaves(tree)
    if given.keys() != mine.keys():
        raise ValueError(f"{UNFIT} (it holds other arrays)")
    arrays = []
    for leaf, (name, own) in zip(leaves, mine.items(), strict=True):
        array = given[name]
        if not isinstance(array, np.ndarray) or _kind(array) != _kind(own):
            raise ValueError(f"{UNFIT} ({name} is {_kind(array)}, not {_kind(own)})")
        numbers = jnp.asarray(array)
        arrays.append(jax.random.wrap_key_data(numbers) if _is_key(leaf) else numbers)
    return jax.tree.unflatten(jax.tree.structure(tree), arrays)


def _kind(value: object) -> str:
    return f"{value.dtype} {value.shape}" if isinstance(value, np.ndarray) else shown(value)
