"""A record that tells of every step towards the best known, in processor time."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.optim.instances.record import Record

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.optimisers.merit import Merit

A_DECADE = 10
"""Steps of the gap that are told of, in each power of ten."""
LEAST_GAP = 1e-8
"""Smaller gaps are one step, and what is better than the best known another one."""


class Event(NamedTuple):
    """What was reached. kind: of EVENTS. evaluations, seconds: by then. value: the merit, NaN where
    nothing is feasible. violation: the least so far. point: the free numbers that `value` is of,
    None where there are none, and of a front."""

    kind: str
    evaluations: int
    seconds: float
    value: float
    violation: float
    point: np.ndarray | None = None


@dataclass
class Watched(Record):
    """The counters of an objective, whose seconds are processor time of this process.

    merit: what points are recorded by; tell: told of an Event when the gap comes below the next of
    A_DECADE steps in a power of ten, or the violation does before anything is feasible. What
    judging takes is left out of the time.
    """

    merit: Merit = field(kw_only=True)
    tell: Callable[[Event], None] = field(kw_only=True)
    started: float = field(default_factory=time.process_time)
    apart: float = 0.0
    reached: float = np.nan
    point: np.ndarray | None = None
    _level: float = np.inf

    @property
    def seconds(self) -> float:
        """Processor time since this was made, without that of judging [s]."""
        return time.process_time() - self.started - self.apart

    def see(
        self, x: np.ndarray, values: np.ndarray, violation: float, feasible: bool, number: int
    ) -> None:
        """Take note of a point, and tell."""
        best, front = len(self.improvements), self.front
        super().see(x, values, violation, feasible, number)
        better = len(self.improvements) > best or self.front is not front
        if not better and (self.improvements or self.front):
            return
        seconds, began = self.seconds, time.process_time()
        if better:
            self._judge(x, float(values[0]), number, seconds)
        else:
            self._tell("violation", _level(self.least_violation), number, seconds)
        self.apart += time.process_time() - began

    def end(self) -> Event:
        """What there is at the end."""
        return Event("end", self.evaluations, self.seconds, self.reached, self.missed, self.point)

    @property
    def missed(self) -> float:
        """The least violation so far; 0 where something is feasible."""
        return 0.0 if self.improvements or self.front else self.least_violation

    def _judge(self, x: np.ndarray, value: float, number: int, seconds: float) -> None:
        merit = self.merit
        if merit.several:
            value = merit.of_front(np.array([one for _, one in self.front]))
        else:
            value = merit.of_point(x, value)
        if np.isnan(self.reached):
            self._level = np.inf  # levels of violations end here
        if not value >= self.reached:
            self.reached = value
            self.point = None if merit.several else np.array(x)
            self._tell("value", _level(float(merit.target.gap(value))), number, seconds)

    def _tell(self, kind: str, level: float, number: int, seconds: float) -> None:
        if level < self._level:
            self._level = level
            self.tell(Event(kind, number, seconds, self.reached, self.missed, self.point))


def _level(gap: float) -> float:
    """The step of a gap on the logarithmic scale, rounded up; the lower the better."""
    if not gap > 0:
        return -np.inf
    return float(np.ceil(np.log10(max(gap, LEAST_GAP)) * A_DECADE))
