"""Callback of Stable-Baselines3: schedules, reports, interruption."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from stickslip.agents.training.sb3.algorithm import LOSSES, set_noise
from stickslip.agents.training.trainer import Update

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.training.groups import LearningConfiguration
    from stickslip.agents.training.sb3.algorithm import Course

SAC_INTERVAL = 2000
"""Steps to the next report; PPO reports every update."""


class Reporter(BaseCallback):
    """Sets the schedules before each rollout, and reports after updates.

    stop: asked after each step whether to leave; what the unfinished rollout gathered is given up,
    so `num_timesteps` is that of the last update.
    """

    def __init__(
        self,
        config: LearningConfiguration,
        course: Course,
        report: Callable[[Update], None],
        stop: Callable[[], bool],
    ):
        super().__init__()
        self._config, self._course = config, course
        self._report, self._stop = report, stop
        self._ended: list[dict[str, Any]] = []
        self._reported_at, self._updated_at = 0, 0
        self._noise = float("nan")
        self.stopped = False

    def _on_training_start(self) -> None:
        self._reported_at = self._updated_at = self.model.num_timesteps
        self._ended.clear()

    def _on_rollout_start(self) -> None:
        self._tell()
        self._updated_at = self.model.num_timesteps
        self._course.share = self.model.num_timesteps / self._config.timesteps
        self._noise = set_noise(self.model, self._config, self._course)  # type: ignore[arg-type]

    def _on_step(self) -> bool:
        for index in np.flatnonzero(self.locals["dones"]):
            self._ended.append(self.locals["infos"][index])
        if self._stop():
            self.model.num_timesteps = self._updated_at
            self.stopped = True
        return not self.stopped

    def _on_training_end(self) -> None:
        if not self.stopped:
            self._tell(always=True)

    def _tell(self, always: bool = False) -> None:
        """Report what the last update ended, if there was one and it is time."""
        gone = self.model.num_timesteps - self._reported_at
        if gone < (1 if always or self._config.algorithm == "ppo" else SAC_INTERVAL):
            return
        self._reported_at = self.model.num_timesteps
        logged = self.model.logger.name_to_value
        losses = LOSSES[self._config.algorithm]
        update = Update(
            timesteps=self.model.num_timesteps,
            learning_rate=self.model.lr_schedule(1.0),
            noise=self._noise,
            ended=_columns(self._ended),
            losses={
                name: float(logged.get("train/" + key, np.nan)) for name, key in losses.items()
            },
        )
        self._ended.clear()
        self._report(update)


def _columns(infos: list[dict[str, Any]]) -> dict[str, np.ndarray]:
    """The numbers of episodes' last infos, by name; {} without any."""
    first = infos[0] if infos else {}
    names = [name for name, value in first.items() if isinstance(value, bool | int | float)]
    return {name: np.asarray([info[name] for info in infos]) for name in names}
