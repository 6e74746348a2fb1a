"""Progress of training: a bar on a terminal, a line for each evaluation everywhere."""

from __future__ import annotations

import math
import sys
import time
from typing import TYPE_CHECKING, NamedTuple, TextIO

from stickslip.agents.training.on_task import evaluation_line
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.agents.machine import Machine


class Progress:
    """bar: a bar on a terminal and lines elsewhere, unless it is False, which is silent.

    after: what follows training, in durations of an evaluation; see Remaining.
    """

    def __init__(
        self,
        total: int,
        at: int = 0,
        bar: bool | None = None,
        to: TextIO | None = None,
        *,
        machine: Machine,
        after: float = 0.0,
    ):
        self._to = sys.stderr if to is None else to
        self._silent, self._machine = bar is False, machine
        self._at = at
        self._begun = time.monotonic()
        self._remaining = Remaining(total, after)
        shown = not self._silent
        self._bar = Bar(
            "training", total, "step", shown, at=at, to=self._to, large=True, lines=False
        )

    def show(self, timesteps: int, row: Mapping[str, float]) -> None:
        """Move the bar; beside it how training episodes go."""
        self._bar.advance(timesteps - self._at, self._machine.beside_bar(row))
        self._at = timesteps
        self._remaining.update(self._passed(), timesteps)

    def tell(self, timesteps: int, row: Mapping[str, float]) -> None:
        """A line for an evaluation."""
        passed = self._passed()
        self._remaining.evaluation(passed, timesteps)
        if self._silent:
            return
        left = self._remaining.seconds()
        to_go = f", about {_clock(left)} to go" if math.isfinite(left) else ""
        line = evaluation_line(self._machine, row)
        text = f"{timesteps:>10,} steps  {line}  {_clock(passed)} gone{to_go}"
        self._bar.say(text.replace("nan", "  -"))

    def _passed(self) -> float:
        return time.monotonic() - self._begun

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.close()


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


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
