"""Proximal policy optimisation in JAX as a trainer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax

from stickslip.agents.protocol import Params, State
from stickslip.agents.training.jax_trainer import JAXTrainer, Learnt
from stickslip.agents.training.learner import network
from stickslip.agents.training.ppo.algorithm import (
    LOSSES,
    Learner,
    begin_learning,
    improve,
    rollout,
    rollout_over,
    settings_of,
)

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.agents.policy.network import MLPPolicy
    from stickslip.agents.training.groups import LearningConfiguration
    from stickslip.agents.training.learner import Now, Rates, Sizes
    from stickslip.envs.collecting import Progress

_improve = jax.jit(improve, static_argnums=(2, 6))
_begin_learning = jax.jit(begin_learning, static_argnums=(0, 1, 2))


class PPOTrainer(JAXTrainer[Learner, State, Params]):
    """Learns from rollouts. `stop` is asked twice an update."""

    @property
    def losses(self) -> tuple[str, ...]:
        """See Trainer."""
        return LOSSES

    def settings(self, config: LearningConfiguration) -> tuple[Sizes, Rates]:
        """See JAXTrainer."""
        return settings_of(config)

    def first_learner(self, inputs: int, outputs: int) -> Learner:
        """See JAXTrainer."""
        return _begin_learning(inputs, outputs, self._sizes, jax.random.key(self.config.seed))

    def learnt(
        self, now: Now, key: Array, progress: Progress[State]
    ) -> Learnt[Learner, State] | None:
        """See JAXTrainer."""
        given = self.env, self._shared, self._sizes, now.noise, self._learner, progress, self._infos
        found = rollout(*given) if self._mesh is None else rollout_over(self._mesh, *given)
        if self.stop():
            return None
        given = self._learner, found, self._sizes, self._rates, now, key, self._mesh
        learner, losses = _improve(*given)
        return Learnt(learner, found, losses)

    def network_of(self, learner: Learner) -> MLPPolicy:
        """See JAXTrainer."""
        return network(learner.actor, learner.seen)
