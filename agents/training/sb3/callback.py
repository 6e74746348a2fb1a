"""What happens while Stable-Baselines3 learns: schedules, metrics, interruption."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from stickslip.agents.training.sb3.algorithm import LOSSES, set_noise

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.machines import Machine
    from stickslip.agents.training.sb3.algorithm import Course

RUN = ("seconds", "steps_per_second", "learning_rate", "noise")
SAC_INTERVAL = 2000
"""Steps to the next row of metrics; for PPO every update has one."""


def metric_columns(algorithm: str, machine: Machine) -> tuple[str, ...]:
    """Columns of metrics.csv after the number of steps."""
    return (*RUN, *machine.EPISODE, *LOSSES[algorithm])


class Reporter(BaseCallback):
    """Sets the schedules before each rollout, and reports a row of metrics after each update.

    report: called with the steps and the row. stop: asked after each step whether to leave; what
    the unfinished rollout gathered is given up, so `num_timesteps` is that of the last update.
    """

    def __init__(
        self,
        config: Any,
        machine: Machine,
        course: Course,
        period: float,
        report: Callable[[int, dict[str, float]], None],
        stop: Callable[[], bool],
    ):
        super().__init__()
        self._config, self._course = config, course
        self._report, self._stop = report, stop
        self._machine, self._period = machine, period
        self._finished: list[dict[str, Any]] = []
        self._begun, self._row_at, self._updated_at = 0.0, 0, 0
        self._noise = float("nan")
        self.seconds = 0.0
        """Trained so far, over every stretch and resumption [s]."""
        self.stopped = False

    def _on_training_start(self) -> None:
        self._begun = time.monotonic()
        self._row_at = self._updated_at = self.model.num_timesteps
        self._finished.clear()

    def _on_rollout_start(self) -> None:
        self._note()
        self._updated_at = self.model.num_timesteps
        self._course.share = self.model.num_timesteps / self._config.timesteps
        self._noise = set_noise(self.model, self._config, self._course)  # type: ignore[arg-type]

    def _on_step(self) -> bool:
        for index in np.flatnonzero(self.locals["dones"]):
            self._finished.append(self.locals["infos"][index])
        if self._stop():
            self.model.num_timesteps = self._updated_at
            self.stopped = True
        return not self.stopped

    def _on_training_end(self) -> None:
        if not self.stopped:
            self._note(always=True)
        self.seconds += time.monotonic() - self._begun

    def _note(self, always: bool = False) -> None:
        """Report what the last update ended, if there was one and it is time."""
        gone = self.model.num_timesteps - self._row_at
        least = 1 if always or self._config.algorithm == "ppo" else SAC_INTERVAL
        if gone < least:
            return
        now = time.monotonic()
        self.seconds, passed = self.seconds + now - self._begun, now - self._begun
        self._begun, self._row_at = now, self.model.num_timesteps
        logged = self.model.logger.name_to_value
        losses = LOSSES[self._config.algorithm]
        row = {
            "seconds": self.seconds,
            "steps_per_second": gone / max(passed, 1e-9),
            "learning_rate": self.model.lr_schedule(1.0),
            "noise": self._noise,
            **self._summary(),
            **{name: float(logged.get("train/" + key, np.nan)) for name, key in losses.items()},
        }
        self._finished.clear()
        self._report(self.model.num_timesteps, row)

    def _summary(self) -> dict[str, float]:
        """Of the training episodes that ended since the last row."""
        if not self._finished:
            return {"episodes": 0}
        return self._machine.summary(self._finished, self._period)
