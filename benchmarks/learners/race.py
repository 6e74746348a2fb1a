"""One learner on one task: its clock, and what its policies score on the way."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, NamedTuple

from benchmarks.tasks.measure import EPISODES, rounded
from benchmarks.training.budgets import training_params
from benchmarks.training.measure import Stopwatch
from benchmarks.training.tables import GOAL, scale_of
from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.evaluation.run import is_random, play
from stickslip.agents.evaluation.standard import keep_of
from stickslip.agents.registry import machine_by_name

if TYPE_CHECKING:
    from stickslip.agents.policy.mlp import MLPPolicy
    from stickslip.envs import TaskDefinition


class Point(NamedTuple):
    """After so many steps and seconds of learning, evaluations aside."""

    steps: int
    wall: float
    processor: float
    score: float


class Race:
    """What a learner is given, and whom it tells.

    It trains on `env` with `params`, the training episodes of `stickslip train`, and calls
    tell(steps, policy) as it goes: true when the goal is reached or `limit` processor seconds are
    spent. Its policies play the task's own episodes in the same program as everybody's.
    """

    def __init__(self, task: TaskDefinition, seed: int, limit: float):
        self.task, self.seed, self.limit = task, seed, limit
        self.env, own = task.make("same_step")
        config: Any = machine_by_name(task.machine).configuration
        self.config = config.of(seed=seed)
        self.params = training_params(task, own, self.config)
        self._own, self._test = own, without_resets(self.env)
        self._seeds = range(EPISODES[task.machine] if is_random(own) else 1)
        self._scale = scale_of(task.name)
        self._watch = Stopwatch()
        self.points: list[Point] = []

    def start(self) -> None:
        """Learning begins; what a learner compiles counts."""
        self._watch.start()

    def tell(self, steps: int, policy: MLPPolicy) -> bool:
        """Score a policy while the clock stands."""
        self._watch.stop()
        score = self._score(policy)
        at = Point(steps, round(self._watch.wall, 2), round(self._watch.processor, 2), score)
        self.points.append(at)
        line = f"{at.steps:>10,} steps {at.wall:7.1f} s {at.processor:7.1f} s  {score:6.3f}"
        print(f"    {line}", flush=True)
        over = score >= GOAL or self._watch.processor >= self.limit
        self._watch.start()
        return over

    def entry(self) -> dict[str, Any]:
        """Of the JSON: the points, and which of them came first to the goal."""
        reached = [index for index, at in enumerate(self.points) if at.score >= GOAL]
        return {
            "digest": self.task.digest,
            "seed": self.seed,
            "limit": self.limit,
            "reached": reached[0] if reached else None,
            "cores": len(os.sched_getaffinity(0)),
            "points": [list(at) for at in self.points],
        }

    def _score(self, policy: MLPPolicy) -> float:
        played = play(self._test, policy, self._own, self._seeds, keep_of)
        return rounded(self._scale.score(float(played.reward.mean())))


def evaluations(total: int, samples: int, most: int = 64) -> range:
    """After how many steps policies are told of: equal stretches of whole updates, so that a
    stretch may be one program."""
    updates = -(-total // samples)
    stretch = samples * -(-updates // most)
    return range(stretch, total + stretch, stretch)
