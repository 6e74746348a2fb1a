"""Known scores of each task: known.json, read and validated."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from stickslip.dynamics.plain_checks import shown
from stickslip.envs.tasks.definition import TaskDefinition
from stickslip.envs.tasks.scale import Interval, Scale, bootstrapped

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np
    from numpy.typing import ArrayLike

    from stickslip.envs.plain import Entries

FILE = Path(__file__).with_name("known.json")
FORMAT, VERSION = "stickslip known scores", 1
SOLVED = 0.9
"""The score from which a task counts as solved."""
ACCEPTED = "accepted: the file as `python -m benchmarks.tasks` writes it"


@dataclass(frozen=True)
class Earned:
    """The mean return of a policy over a task's episodes; low, high: its 95 % interval, None where
    the task has one episode. failures: share of episodes that ended before their time. returns: of
    every episode, empty where they were not kept."""

    policy: str
    value: float
    low: float | None
    high: float | None
    failures: float
    returns: tuple[float, ...] = ()

    @property
    def shown(self) -> str:
        """The mean return, and the failures if there are any."""
        return f"{self.value:.4g}" + (f", {self.failures:.0%} fail" if self.failures else "")


@dataclass(frozen=True)
class Bound:
    """Upper bound on every policy's return. reason: why, and what is assumed."""

    value: float
    reason: str


@dataclass(frozen=True)
class Learned:
    """Results of training over the same episodes. how: algorithm, settings, steps. returns: mean
    return of each seed's policy."""

    how: str
    returns: tuple[float, ...]


@dataclass(frozen=True)
class Known:
    """Measurements of a task, over the episodes of seeds 0, 1, ..., episodes - 1.

    trivial: what a score of 0 is. baselines: hand-written controllers. planners: what plans each
    episode with exact knowledge of it, and what improves a baseline so. best: the most that any
    policy has earned in replay, a score of 1, no proof that no more can be; how: where it came
    from. bound: proved, or None. assumed: proved of policies that meet the assumptions of its
    reason, or None: others may earn more. learned: by training, or None where none was tried.
    """

    task: str
    episodes: int
    trivial: Earned
    baselines: tuple[Earned, ...]
    planners: tuple[Earned, ...]
    best: Earned
    how: str
    bound: Bound | None
    learned: Learned | None = None
    assumed: Bound | None = None

    @property
    def scale(self) -> Scale:
        """Scale from returns to scores."""
        return Scale(self.trivial.value, self.best.value)

    def score(self, returns: ArrayLike, seeds: Sequence[int] | None = None) -> Interval:
        """Score of episodes' mean return, (return - zero) / (one - zero), with its interval.

        seeds: of the episodes, None for others than the task's own. On the task's own, zero and
        one are of the same episodes, and so is every bootstrap sample.
        """
        return self._of_means(lambda r, zero, one: (r - zero) / (one - zero), returns, seeds)

    def gap(self, returns: ArrayLike, seeds: Sequence[int] | None = None) -> Interval:
        """Gap to the best known, one - return, in the return's unit; see `score`."""
        return self._of_means(lambda r, zero, one: one - r, returns, seeds)

    def score_of(self, earned: Earned) -> Interval:
        """Score of a measured policy; no interval where its returns were not kept."""
        if len(earned.returns) == self.episodes:
            return self.score(earned.returns, range(self.episodes))
        return Interval(self.scale.score(earned.value))

    def _of_means(
        self,
        statistic: Callable[..., np.ndarray],
        returns: ArrayLike,
        seeds: Sequence[int] | None,
    ) -> Interval:
        both = (self.trivial, self.best)
        kept = all(len(one.returns) == self.episodes for one in both)
        ends = [one.returns if kept else (one.value,) for one in both]
        if seeds is None or max(seeds) >= self.episodes:
            return bootstrapped(statistic, returns, *ends, paired=False)
        if not kept:  # nothing to compare the episodes with
            return Interval(bootstrapped(statistic, returns, *ends, paired=False).value)
        own = [[of[seed] for seed in seeds] for of in ends]
        return bootstrapped(statistic, returns, *own, paired=True)

    @property
    def by_hand(self) -> Earned:
        """The best hand-written baseline."""
        return max(self.baselines, key=lambda one: one.value)


def known_of(task: TaskDefinition) -> Known | None:
    """Measurements of a task; None where nothing was measured.

    ValueError naming the file where it is damaged, or measured another definition of that name.
    """
    content = read_known(FILE).get(task.name)
    if content is None:
        return None
    if content.get("digest") != task.digest:
        raise ValueError(f"{FILE}: {task.name} was measured by another definition; {ACCEPTED}")
    try:
        return _known(task.name, content)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ValueError(f"{FILE}: {task.name}: {shown(error)}; {ACCEPTED}") from error


def threshold(task: TaskDefinition) -> float | None:
    """The return from which a task counts as solved: a score of 0.9. None where nothing is known,
    and where the file is damaged, which is no reason to register no environment."""
    try:
        known = known_of(task)
    except ValueError:
        return None
    return None if known is None else round(known.scale.earned(SOLVED), 4)


@lru_cache(maxsize=4)
def read_known(path: Path) -> Entries:
    """The tasks of a file by name. ValueError naming it where it cannot be read."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if (content["format"], content["version"]) != (FORMAT, VERSION):
            raise ValueError(f"format {content['format']}, version {content['version']}")
        tasks = content["tasks"]
        if not all(isinstance(one, dict) for one in tasks.values()):
            raise ValueError("tasks that are no objects")
    except (OSError, KeyError, TypeError, ValueError, AttributeError, RecursionError) as error:
        raise ValueError(f"{path}: {shown(error)}; {ACCEPTED}") from error
    return tasks


def _known(name: str, content: Entries) -> Known:
    learned = content.get("learned")
    known = Known(
        task=name,
        episodes=int(content["episodes"]),
        trivial=earned_in(content["trivial"]),
        baselines=tuple(map(earned_in, content["baselines"])),
        planners=tuple(map(earned_in, content["planners"])),
        best=earned_in(content["best"]),
        how=str(content["how"]),
        bound=_bound(content["bound"]),
        learned=None if learned is None else _learned(learned),
        assumed=_bound(content.get("assumed")),
    )
    if known.bound is not None and not known.best.value <= known.bound.value:
        raise ValueError(f"best {known.best.value} above the bound {known.bound.value}")
    Scale(known.trivial.value, known.best.value)  # for its ValueError
    everybody = (known.trivial, *known.baselines, *known.planners, known.best)
    if any(len(one.returns) not in (0, known.episodes) for one in everybody):
        raise ValueError(f"returns of other than {known.episodes} episodes")
    return known


def _bound(content: Entries | None) -> Bound | None:
    return None if content is None else Bound(_number(content["value"]), str(content["reason"]))


def _learned(content: Entries) -> Learned:
    return Learned(str(content["how"]), tuple(map(_number, content["returns"])))


def earned_in(content: Entries) -> Earned:
    """Return of a policy from an entry of the file; ValueError for a damaged one."""
    low, high = (None if content[end] is None else _number(content[end]) for end in ("low", "high"))
    failures = _number(content["failures"])
    returns = tuple(map(_number, content.get("returns", ())))
    return Earned(str(content["policy"]), _number(content["return"]), low, high, failures, returns)


def _number(given: object) -> float:
    if isinstance(given, bool) or not isinstance(given, int | float) or not math.isfinite(given):
        raise ValueError(f"{shown(given)} is no finite number")
    return float(given)
