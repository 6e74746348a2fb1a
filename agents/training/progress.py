"""Progress of training: a bar on a terminal, a line for each evaluation everywhere."""

from __future__ import annotations

import math
import sys
import time
from typing import TYPE_CHECKING, TextIO

from stickslip.agents.training.on_task import evaluation_line
from stickslip.agents.training.remaining import Remaining
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
