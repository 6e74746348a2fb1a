"""PPO and SAC of Stable-Baselines3 as a trainer."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.agents.policy.sb3 import from_sb3
from stickslip.agents.protocol import Params, State
from stickslip.agents.training.groups import LearningConfiguration
from stickslip.agents.training.sb3 import algorithm
from stickslip.agents.training.sb3.callback import Reporter
from stickslip.agents.training.trainer import Trainer
from stickslip.envs.adapters.sb3 import SB3VecEnv

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.policy.network import MLPPolicy
    from stickslip.agents.training.checkpoint import ModelState
    from stickslip.agents.training.trainer import Update
    from stickslip.envs.functional import FunctionalEnv


class SB3Trainer(Trainer[LearningConfiguration, State, Params]):
    """Stable-Baselines3 on the processor; which algorithm the configuration says."""

    def __init__(
        self,
        config: LearningConfiguration,
        env: FunctionalEnv[State, Params],
        params: Params,
        report: Callable[[Update], None],
        stop: Callable[[], bool],
        devices: int | None = None,
    ):
        super().__init__(config, env, params, report, stop, devices)
        if devices is not None:
            raise ValueError(f"devices = {devices} with trainer = 'sb3'; accepted: 'jax'")
        self._envs = SB3VecEnv(env, params, config.num_envs, config.seed)
        self._course = algorithm.Course()
        self._model = algorithm.make_model(config, self._envs, self._course)
        self._reporter = Reporter(config, self._course, self._tell, stop)

    @property
    def losses(self) -> tuple[str, ...]:
        """See Trainer."""
        return tuple(algorithm.LOSSES[self.config.algorithm])

    def begin_stretch(self, timesteps: int) -> None:
        """See Trainer."""
        self.timesteps, self._course.share = timesteps, timesteps / self.config.timesteps
        algorithm.begin_stretch(self._model, self.config.seed, timesteps)

    def advance(self, goal: int) -> None:
        """See Trainer."""
        self._model.learn(
            goal - self.timesteps, self._reporter, log_interval=10**9, reset_num_timesteps=False
        )
        self.timesteps, self.stopped = self._model.num_timesteps, self._reporter.stopped

    def take_state(self) -> ModelState:
        """See Trainer."""
        return algorithm.take_state(self._model)

    def put_state(self, state: ModelState) -> None:
        """See Trainer."""
        algorithm.put_state(self._model, state)

    def policy(self) -> MLPPolicy:
        """See Trainer."""
        return from_sb3(self._model)

    def is_finite(self) -> bool:
        """See Trainer."""
        return algorithm.is_finite(self._model)

    def close(self) -> None:
        """See Trainer."""
        self._envs.close()

    def _tell(self, update: Update) -> None:
        self.timesteps = update.timesteps
        self.report(update)
