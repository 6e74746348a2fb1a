"""What the trainers in JAX share: devices, episodes, checkpoints, and the loop of updates."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import is_dataclass, replace
from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.protocol import Params, State
from stickslip.agents.training.groups import LearningConfiguration
from stickslip.agents.training.learner import (
    COPIED,
    SPREAD,
    Start,
    begin_episodes,
    fetched,
    is_key,
    mesh_for,
    put,
)
from stickslip.agents.training.trainer import Trainer, Update
from stickslip.dynamics.checks import shown

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from jaxtyping import Array

    from stickslip.agents.policy.network import MLPPolicy
    from stickslip.agents.training.checkpoint import ModelState
    from stickslip.agents.training.learner import Now, Rates, Sizes
    from stickslip.envs.collecting import Collected, Progress
    from stickslip.envs.functional import FunctionalEnv

Tree = TypeVar("Tree")
Learner = TypeVar("Learner")
"""All that learning goes on from: a tree of arrays."""
UNFIT = "its contents do not fit the configuration"


class Learnt(NamedTuple, Generic[Learner, State]):
    """What came of an update."""

    learner: Learner
    found: Collected[State]
    """What was done in it; of what it kept, the infos are read."""
    losses: Mapping[str, Array]


class JAXTrainer(Trainer[LearningConfiguration, State, Params], Generic[Learner, State, Params]):
    """JAX on whichever platform it finds, over several devices where `mesh_for` finds them.

    A subclass says what a learner is and what an update does to it.
    """

    def __init__(
        self,
        config: LearningConfiguration,
        env: FunctionalEnv[State, Params],
        params: Params,
        report: Callable[[Update], None],
        stop: Callable[[], bool],
        devices: int | None = None,
    ):
        super().__init__(config, same_step(env), params, report, stop, devices)
        self._sizes, self._rates = self.settings(config)
        self._mesh = mesh_for(devices, self._sizes.num_envs, self._sizes.batch_size)
        inputs, self._infos = shapes_of(self.env, params)
        learner = self.first_learner(inputs, len(env.action_names))
        self._learner = put(self._mesh, learner, COPIED)
        self._shared = put(self._mesh, params, COPIED)
        self._start: Start | None = None

    @abstractmethod
    def settings(self, config: LearningConfiguration) -> tuple[Sizes, Rates]:
        """What a training configuration says."""

    @abstractmethod
    def first_learner(self, inputs: int, outputs: int) -> Learner:
        """A fresh learner for so many numbers in an observation and in an action."""

    @abstractmethod
    def learnt(
        self, now: Now, key: Array, progress: Progress[State]
    ) -> Learnt[Learner, State] | None:
        """One update of the learner; None where it is stopped on the way."""

    @abstractmethod
    def network_of(self, learner: Learner) -> MLPPolicy:
        """What is shipped of a learner."""

    def begin_stretch(self, timesteps: int) -> None:
        """See Trainer. Episodes and random numbers are in the state, so they go on."""
        self.timesteps = timesteps
        self._start = self._begun()

    def _begun(self) -> Start:
        """Where the episodes are: at their beginning, if nothing else was said."""
        if self._start is not None:
            return self._start
        begun = begin_episodes(self.env, self.params, self._sizes, self.config.seed)
        return begun._replace(progress=put(self._mesh, begun.progress, SPREAD))

    def advance(self, goal: int) -> None:
        """See Trainer."""
        self._start = self._begun()
        while self.timesteps < goal and not self.stopped:
            self._update()

    def _update(self) -> None:
        """What one update teaches; nothing, where it is stopped."""
        progress, key = self._begun()
        now = self._rates.at(jnp.float32(self.timesteps / self.config.timesteps))
        own = jax.random.fold_in(key, self.timesteps // self._sizes.samples)
        now, own = put(self._mesh, (now, own), COPIED)
        learnt = self.learnt(now, own, progress)
        if learnt is None:
            self.stopped = True
            return
        ended = ended_in(learnt.found, self._infos)
        jax.block_until_ready(learnt.learner)
        if self.stop():
            self.stopped = True
            return
        self._learner, self._start = learnt.learner, Start(learnt.found.progress, key)
        self.timesteps += self._sizes.samples
        self.report(
            Update(
                timesteps=self.timesteps,
                learning_rate=float(now.learning_rate),
                noise=float(now.noise),
                ended=ended,
                losses={name: float(learnt.losses[name]) for name in self.losses},
            )
        )

    def take_state(self) -> ModelState:
        """See Trainer."""
        episodes = _named(self._begun().progress)
        return {"learner": {**_named(self._learner)}, "episodes": {**episodes}}

    def put_state(self, state: ModelState) -> None:
        """See Trainer."""
        learner = _filled("learner", self._learner, state.get("learner"))
        start = self._begun()
        progress = _filled("episodes", start.progress, state.get("episodes"))
        self._learner = put(self._mesh, learner, COPIED)
        self._start = start._replace(progress=put(self._mesh, progress, SPREAD))

    def policy(self) -> MLPPolicy:
        """See Trainer."""
        learner = self._learner
        if self._mesh is not None:  # what acts with it does so on one device
            learner = jax.tree.map(jnp.asarray, fetched(learner))
        return self.network_of(learner).validate()

    def is_finite(self) -> bool:
        """See Trainer."""
        return all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(fetched(self._learner)))

    def close(self) -> None:
        """See Trainer."""
        self._start = None


def same_step(env: FunctionalEnv[State, Params]) -> FunctionalEnv[State, Params]:
    """The environment as rollouts need it: every step is one of an episode."""
    return replace(env, autoreset="same_step") if is_dataclass(env) else env


def shapes_of(env: FunctionalEnv[State, Params], params: Params) -> tuple[int, tuple[str, ...]]:
    """How many numbers an observation has, and the names of those in info."""

    def first(key: Array) -> tuple[Array, dict[str, Array]]:
        obs, state = env.reset_env(key, params)
        info = env.step_env(state, jnp.zeros(len(env.action_names)), params)[5]
        return obs, {name: value for name, value in info.items() if jnp.ndim(value) == 0}

    obs, info = jax.eval_shape(first, jax.random.key(0))
    return obs.shape[-1], tuple(info)


def ended_in(found: Collected, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """What the last infos of the episodes that ended in a rollout held; {} without any."""
    terminated, truncated = fetched((found.terminated, found.truncated))
    over = terminated | truncated
    if not over.any():
        return {}
    kept = fetched({name: found.kept[name] for name in names})
    return {name: np.asarray(values)[over] for name, values in kept.items()}


def _named(tree: object) -> dict[str, np.ndarray]:
    """A tree's arrays by the way to each; random keys as plain numbers."""
    leaves = jax.tree.leaves_with_path(fetched(tree))
    return {jax.tree_util.keystr(path): leaf for path, leaf in leaves}


def _filled(what: str, tree: Tree, given: object) -> Tree:
    """The tree with the arrays that `_named` gave. ValueError for those of another tree."""
    mine, leaves = _named(tree), jax.tree.leaves(tree)
    if not isinstance(given, dict) or given.keys() != mine.keys():
        raise ValueError(f"{UNFIT} (its {what} holds other arrays)")
    arrays = []
    for leaf, (name, own) in zip(leaves, mine.items(), strict=True):
        array = given[name]
        if not isinstance(array, np.ndarray) or _kind(array) != _kind(own):
            raise ValueError(f"{UNFIT} ({what}{name} is {_kind(array)}, not {_kind(own)})")
        arrays.append(_like(leaf, array))
    return jax.tree.unflatten(jax.tree.structure(tree), arrays)


def _like(leaf: Array, array: np.ndarray) -> Array:
    numbers = jnp.asarray(array)
    return jax.random.wrap_key_data(numbers) if is_key(leaf) else numbers


def _kind(value: object) -> str:
    return f"{value.dtype} {value.shape}" if isinstance(value, np.ndarray) else shown(value)
