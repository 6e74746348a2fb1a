"""Estimate of a run's remaining time, from its recent speed."""

from __future__ import annotations

import math
from typing import NamedTuple

PERIODS = 2
"""So many whole periods, each from one evaluation to the next, are what "lately" means."""


class Point(NamedTuple):
    """Steps of a run at a time."""

    seconds: float
    timesteps: int


class Remaining:
    """Time to the end of a run, from notes of how far it is.

    The rate is that of the last whole periods between evaluations, so that it counts evaluations
    and checkpoints as often as they come, and follows a machine that becomes slower or quicker.
    Before the second evaluation it is that of the updates since the first one, which is left out:
    programs are compiled in it. after: what follows training, in durations of the first evaluation
    (both are mostly compilation).
    """

    def __init__(self, total: int, after: float = 0.0):
        self._total, self._after = total, after
        self._updates: list[Point] = []
        self._evaluated: list[Point] = []
        self._first_evaluation = 0.0

    def update(self, seconds: float, timesteps: int) -> None:
        """An update of the policy ended."""
        point = Point(seconds, timesteps)
        self._updates = [*self._updates[:1], point]

    def evaluation(self, seconds: float, timesteps: int) -> None:
        """An evaluation ended."""
        if not self._evaluated and self._updates:
            self._first_evaluation = seconds - self._updates[-1].seconds
        self._evaluated = [*self._evaluated, Point(seconds, timesteps)][-PERIODS - 1 :]

    def seconds(self) -> float:
        """To the end of everything, from the last note on; NaN while nothing is known."""
        notes = self._evaluated if len(self._evaluated) > 1 else self._updates
        if not notes:
            return math.nan
        first, last = notes[0], notes[-1]
        latest = max((one.timesteps for one in (*self._updates, *self._evaluated)), default=0)
        steps = self._total - latest
        after = self._after * self._first_evaluation
        if last.timesteps <= first.timesteps:
            return after if steps <= 0 else math.nan
        rate = (last.timesteps - first.timesteps) / (last.seconds - first.seconds)
        return max(steps, 0) / rate + after
