"""Short-horizon actor-critic in JAX as a trainer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax

from stickslip.agents.protocol import Params, State
from stickslip.agents.training.jax_trainer import JAXTrainer, Learnt
from stickslip.agents.training.shac.algorithm import (
    LOSSES,
    ShortLearner,
    acting,
    begin_learning,
    improve,
    settings_of,
)

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.agents.policy.network import MLPPolicy
    from stickslip.agents.training.groups import LearningConfiguration
    from stickslip.agents.training.learner import Now
    from stickslip.agents.training.shac.algorithm import ShortRates, ShortSizes
    from stickslip.envs.collecting import Progress

_improve = jax.jit(improve, static_argnums=(0, 2, 8, 9))
_begin_learning = jax.jit(begin_learning, static_argnums=(0, 1, 2))


class SHACTrainer(JAXTrainer[ShortLearner, State, Params]):
    """Learns from derivatives through the environment's step, which has to have them. `stop` is
    asked after every update."""

    @property
    def losses(self) -> tuple[str, ...]:
        """See Trainer."""
        return LOSSES

    def settings(self, config: LearningConfiguration) -> tuple[ShortSizes, ShortRates]:
        """See JAXTrainer."""
        return settings_of(config)

    def first_learner(self, inputs: int, outputs: int) -> ShortLearner:
        """See JAXTrainer."""
        return _begin_learning(inputs, outputs, self._sizes, jax.random.key(self.config.seed))

    def learnt(
        self, now: Now, key: Array, progress: Progress[State]
    ) -> Learnt[ShortLearner, State] | None:
        """See JAXTrainer."""
        given = self.env, self._shared, self._sizes, self._rates, now, self._learner, progress, key
        return Learnt(*_improve(*given, self._infos, self._mesh))

    def network_of(self, learner: ShortLearner) -> MLPPolicy:
        """See JAXTrainer."""
        return acting(learner)
