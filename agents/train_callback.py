"""What happens while Stable-Baselines3 learns: schedules, metrics, interruption."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from stickslip.agents.train_algorithm import LOSSES, set_noise
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.config import TrainConfig
    from stickslip.agents.train_algorithm import Course

EPISODE = (
    "episodes",
    "return",
    "duration",
    "mean_crank_rate",
    "speed",
    "slip_per_metre",
    "energy_per_metre",
    "falls",
)
RUN = ("seconds", "steps_per_second", "learning_rate", "noise")
SAC_INTERVAL = 2000
"""Steps to the next row of metrics; for PPO every update has one."""


def metric_columns(algorithm: str) -> tuple[str, ...]:
    """Columns of metrics.csv after the number of steps."""
    return (*RUN, *EPISODE, *LOSSES[algorithm])


@dataclass
class Finished:
    """Sums over the training episodes that ended since the last row."""

    period: float
    rows: list[tuple[float, ...]] = field(default_factory=list)

    def add(self, info: dict[str, Any]) -> None:
        """An episode's last info."""
        names = ("return", "length", "walked", "slid", "energy", "mean_rate")
        fell = float(info["status"] > Status.SLIP_ONSET)
        self.rows.append((*(float(info["episode_" + name]) for name in names), fell))

    def summary(self) -> dict[str, float]:
        """Means over the episodes and ratios of sums; empty without an episode."""
        if not self.rows:
            return {"episodes": 0}
        total, length, walked, slid, energy, rate, fell = np.asarray(self.rows).T
        far = walked.sum() > 0.1
        return {
            "episodes": len(self.rows),
            "return": total.mean(),
            "duration": length.mean() * self.period,
            "mean_crank_rate": np.average(rate, weights=length),
            "speed": walked.sum() / (length.sum() * self.period),
            "slip_per_metre": slid.sum() / walked.sum() if far else np.nan,
            "energy_per_metre": energy.sum() / walked.sum() if far else np.nan,
            "falls": fell.mean(),
        }


class Reporter(BaseCallback):
    """Sets the schedules before each rollout, and reports a row of metrics after each update.

    report: called with the steps and the row. stop: asked after each step whether to leave; what
    the unfinished rollout gathered is given up, so `num_timesteps` is that of the last update.
    """

    def __init__(
        self,
        config: TrainConfig,
        course: Course,
        period: float,
        report: Callable[[int, dict[str, float]], None],
        stop: Callable[[], bool],
    ):
        super().__init__()
        self._config, self._course = config, course
        self._report, self._stop = report, stop
        self._finished = Finished(period)
        self._begun, self._row_at, self._updated_at = 0.0, 0, 0
        self._noise = float("nan")
        self.seconds = 0.0
        """Trained so far, over every stretch and resumption [s]."""
        self.stopped = False

    def _on_training_start(self) -> None:
        self._begun = time.monotonic()
        self._row_at = self._updated_at = self.model.num_timesteps
        self._finished.rows.clear()

    def _on_rollout_start(self) -> None:
        self._note()
        self._updated_at = self.model.num_timesteps
        self._course.share = self.model.num_timesteps / self._config.timesteps
        self._noise = set_noise(self.model, self._config, self._course)  # type: ignore[arg-type]

    def _on_step(self) -> bool:
        for index in np.flatnonzero(self.locals["dones"]):
            self._finished.add(self.locals["infos"][index])
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
            **self._finished.summary(),
            **{name: float(logged.get("train/" + key, np.nan)) for name, key in losses.items()},
        }
        self._finished.rows.clear()
        self._report(self.model.num_timesteps, row)
