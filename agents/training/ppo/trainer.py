"""Proximal policy optimisation in JAX as a trainer."""

from __future__ import annotations

from dataclasses import is_dataclass, replace
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.protocol import Params, State
from stickslip.agents.training.groups import LearningConfiguration
from stickslip.agents.training.ppo.algorithm import (
    LOSSES,
    Learner,
    Start,
    begin_learning,
    begin_stretch,
    improve,
    network,
    rollout,
)
from stickslip.agents.training.ppo.settings import settings_of
from stickslip.agents.training.trainer import Trainer, Update
from stickslip.dynamics.checks import shown

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.policy.mlp import MLPPolicy
    from stickslip.agents.training.state_file import ModelState
    from stickslip.envs.collecting import Collected
    from stickslip.envs.functional import FunctionalEnv

UNFIT = "its contents do not fit the configuration"
_improve = jax.jit(improve, static_argnums=2)
_begin_learning = jax.jit(begin_learning, static_argnums=(0, 1, 2))


class PPOTrainer(Trainer[LearningConfiguration, State, Params]):
    """JAX on whichever platform it finds. `stop` is asked twice an update."""

    def __init__(
        self,
        config: LearningConfiguration,
        env: FunctionalEnv[State, Params],
        params: Params,
        report: Callable[[Update], None],
        stop: Callable[[], bool],
    ):
        super().__init__(config, same_step(env), params, report, stop)
        self._sizes, self._rates = settings_of(config)
        inputs, self._infos = shapes_of(self.env, params)
        outputs = len(env.action_names)
        self._learner = _begin_learning(inputs, outputs, self._sizes, jax.random.key(config.seed))
        self._start: Start | None = None
        self._updates = 0

    @property
    def losses(self) -> tuple[str, ...]:
        """See Trainer."""
        return LOSSES

    def begin_stretch(self, timesteps: int) -> None:
        """See Trainer."""
        self.timesteps, self._updates = timesteps, 0
        self._start = begin_stretch(self.env, self.params, self._sizes, self.config.seed, timesteps)

    def advance(self, goal: int) -> None:
        """See Trainer."""
        if self._start is None:
            self.begin_stretch(self.timesteps)
        while self.timesteps < goal and not self.stopped:
            self._update()

    def _update(self) -> None:
        """One rollout and what is learnt from it; neither, where it is stopped."""
        progress, key = self._start  # type: ignore[misc]
        now = self._rates.at(jnp.float32(self.timesteps / self.config.timesteps))
        given = self.env, self.params, self._sizes, now.noise, self._learner
        found = rollout(*given, progress, self._infos)
        if self.stop():
            self.stopped = True
            return
        updated = jax.random.fold_in(key, self._updates)
        learner, losses = _improve(self._learner, found, self._sizes, self._rates, now, updated)
        ended = ended_in(found, self._infos)
        jax.block_until_ready(learner)
        if self.stop():
            self.stopped = True
            return
        self._learner, self._start = learner, Start(found.progress, key)
        self._updates += 1
        self.timesteps += self._sizes.samples
        self.report(
            Update(
                timesteps=self.timesteps,
                learning_rate=float(now.learning_rate),
                noise=float(now.noise),
                ended=ended,
                losses={name: float(losses[name]) for name in LOSSES},
            )
        )

    def take_state(self) -> ModelState:
        """See Trainer."""
        return {"learner": {**_named(self._learner)}}

    def put_state(self, state: ModelState) -> None:
        """See Trainer."""
        mine, given = _named(self._learner), state.get("learner")
        if not isinstance(given, dict) or given.keys() != mine.keys():
            raise ValueError(f"{UNFIT} (it holds another learner)")
        leaves: dict[Any, Any] = {**given}
        for name, own in mine.items():
            if _kind(leaves[name]) != _kind(own):
                what = f"{_kind(leaves[name])}, not {_kind(own)}"
                raise ValueError(f"{UNFIT} (learner{name} is {what})")
        arrays = [jnp.asarray(leaves[name]) for name in mine]
        self._learner = jax.tree.unflatten(jax.tree.structure(self._learner), arrays)

    def policy(self) -> MLPPolicy:
        """See Trainer."""
        return network(self._learner.actor, self._learner.seen).validate()

    def is_finite(self) -> bool:
        """See Trainer."""
        return all(bool(jnp.isfinite(leaf).all()) for leaf in jax.tree.leaves(self._learner))

    def close(self) -> None:
        """See Trainer."""
        self._start = None


def same_step(env: FunctionalEnv[State, Params]) -> FunctionalEnv[State, Params]:
    """The environment as rollouts need it: every step is one of an episode."""
    return replace(env, autoreset="same_step") if is_dataclass(env) else env


def shapes_of(env: FunctionalEnv[State, Params], params: Params) -> tuple[int, tuple[str, ...]]:
    """How many numbers an observation has, and the names of those in info."""

    def first(key: Any) -> Any:
        obs, state = env.reset_env(key, params)
        info = env.step_env(state, jnp.zeros(len(env.action_names)), params)[5]
        return obs, {name: value for name, value in info.items() if jnp.ndim(value) == 0}

    obs, info = jax.eval_shape(first, jax.random.key(0))
    return obs.shape[-1], tuple(info)


def ended_in(found: Collected, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """What the last infos of the episodes that ended in a rollout held; {} without any."""
    over = np.asarray(found.terminated | found.truncated)
    if not over.any():
        return {}
    return {name: np.asarray(found.kept[name])[over] for name in names}


def _kind(value: Any) -> str:
    return f"{value.dtype} {value.shape}" if isinstance(value, np.ndarray) else shown(value)


def _named(learner: Learner) -> dict[str, np.ndarray]:
    """The learner's arrays by the way to each."""
    leaves = jax.tree.leaves_with_path(learner)
    return {jax.tree_util.keystr(path): np.asarray(leaf) for path, leaf in leaves}
