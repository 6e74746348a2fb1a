"""What is known of a task measured again: baselines, planners and doing nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from benchmarks.tasks.measure import DIGITS, played_on
from stickslip.agents.idle import Idle
from stickslip.agents.registry import machine_by_name

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stickslip.envs import TaskDefinition
    from stickslip.envs.tasks.known import Earned, Known


class Again(NamedTuple):
    """One policy on one task: what is written of it, and what it earns now."""

    task: str
    written: Earned
    earned: float
    scale: float
    """Of returns: from a score of 0 to one of 1."""

    @property
    def score_off(self) -> float:
        """By how much its score is another one."""
        return abs(self.earned - self.written.value) / self.scale

    @property
    def same(self) -> bool:
        """Whether it is the number that is written, to its last digit."""
        return float(f"{self.earned:.{DIGITS}g}") == self.written.value

    def line(self) -> str:
        """In words."""
        is_same = "as written" if self.same else f"written {self.written.value:.6g}, score off by "
        off = "" if self.same else f"{self.score_off:.1e}"
        return f"{self.task}: {self.written.policy} earns {self.earned:.6g}, {is_same}{off}"


def measured_again(task: TaskDefinition, known: Known) -> Iterator[Again]:
    """Doing nothing and every baseline of a task, one after the other; the best known, which takes
    minutes of dynamic programming, is left out, and so is what was the best known before."""
    env, _ = task.make()
    machine = machine_by_name(task.machine)
    for written in (known.trivial, *known.baselines, *known.planners):
        idle = written is known.trivial
        if not idle and written.policy not in machine.baselines:
            continue
        player = Idle(machine.outputs) if idle else machine.baseline(written.policy, env)
        played = played_on(task, player, known.episodes)
        earned = float(played.reward.mean())
        yield Again(task.name, written, earned, known.scale.one - known.scale.zero)
