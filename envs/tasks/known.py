"""Known scores of each task, normalised: 0 = zero action, 1 = best known."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from stickslip.dynamics.checks import shown
from stickslip.envs.tasks.definition import TaskDefinition, task_by_name

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike

    from stickslip.envs.functional import Entries

FILE = Path(__file__).with_name("known.json")
SOLVED = 0.9
"""The score from which a task counts as solved."""
CONFIDENCE = 0.95
RESAMPLES = 2000
UNKNOWN = float("nan")
OVER = "over the limit"
"""Score of who costs more than the task's limit, in words."""


class Interval(NamedTuple):
    """An estimate and its confidence interval; NaN where there is none."""

    value: float
    low: float = UNKNOWN
    high: float = UNKNOWN

    def shown(self, decimals: int) -> str:
        """The value and half the width of its interval, if it has one."""
        half = (self.high - self.low) / 2
        width = f" ± {half:.{decimals}f}" if math.isfinite(half) else ""
        return f"{self.value:.{decimals}f}{width}"


@dataclass(frozen=True)
class Scale:
    """The two returns that a task's scores lie between. ValueError unless zero < one."""

    zero: float
    one: float

    def __post_init__(self):
        if not self.zero < self.one:
            raise ValueError(
                f"zero = {self.zero}, one = {self.one}; accepted: finite returns, zero < one"
            )

    def score(self, earned: Any) -> Any:
        """(earned - zero) / (one - zero), of numbers or arrays; above 1: more than was known."""
        return (earned - self.zero) / (self.one - self.zero)

    def earned(self, score: float) -> float:
        """The return of a score."""
        return self.zero + score * (self.one - self.zero)


@dataclass(frozen=True)
class Earned:
    """The mean return of a policy over a task's episodes; low, high: its 95 % interval, None where
    the task has one episode. failures: share of episodes that ended before their time. returns: of
    every episode, empty where they were not kept. cost: an episode's mean, None without a limit."""

    policy: str
    value: float
    low: float | None
    high: float | None
    failures: float
    returns: tuple[float, ...] = ()
    cost: float | None = None

    @property
    def shown(self) -> str:
        """The mean return, the failures if there are any, and the cost where there is a limit."""
        cost = "" if self.cost is None else f" at a cost of {self.cost:.2g}"
        return f"{self.value:.4g}{cost}" + (f", {self.failures:.0%} fail" if self.failures else "")


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
    cost_limit: what costs more in the mean has no score, and is no best; None: no limit.
    """

    episodes: int
    trivial: Earned
    baselines: tuple[Earned, ...]
    planners: tuple[Earned, ...]
    best: Earned
    how: str
    bound: Bound | None
    learned: Learned | None = None
    assumed: Bound | None = None
    cost_limit: float | None = None

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

    def keeps(self, cost: float | None) -> bool:
        """True where a mean cost is within the limit."""
        return self.cost_limit is None or (cost is not None and cost <= self.cost_limit)

    def score_of(self, earned: Earned) -> Interval:
        """Score of a measured policy, NaN over the cost limit; no interval without its returns."""
        if not self.keeps(earned.cost):
            return Interval(UNKNOWN)
        if len(earned.returns) == self.episodes:
            return self.score(earned.returns, range(self.episodes))
        return Interval(self.scale.score(earned.value))

    def _of_means(
        self, statistic: Callable[..., np.ndarray], returns: ArrayLike, seeds: Sequence[int] | None
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
        """The best hand-written baseline; first of all it keeps the cost limit."""
        return max(self.baselines, key=lambda one: (self.keeps(one.cost), one.value))


def known_of(task: TaskDefinition) -> Known | None:
    """Measurements of a task, or None. ValueError for those of another definition."""
    content = read_known().get(task.name)
    if content is None:
        return None
    if content["digest"] != task.digest:
        given = f"{FILE}: {task.name} was measured by another definition"
        raise ValueError(f"{given}; accepted: the file as `python -m benchmarks.tasks` writes it")
    learned = content.get("learned")
    return Known(
        episodes=content["episodes"],
        trivial=earned_in(content["trivial"]),
        baselines=tuple(map(earned_in, content["baselines"])),
        planners=tuple(map(earned_in, content["planners"])),
        best=earned_in(content["best"]),
        how=content["how"],
        bound=content["bound"] and Bound(**content["bound"]),
        learned=None if learned is None else Learned(learned["how"], tuple(learned["returns"])),
        assumed=content.get("assumed") and Bound(**content["assumed"]),
        cost_limit=task.cost_limit,
    )


def measured(name: str) -> Known:
    """The same of a task's name. ValueError where nothing was measured."""
    if (known := known_of(task_by_name(name))) is None:
        raise ValueError(f"{name} was not measured; accepted: a task with a best known return")
    return known


def episodes_digest(task: TaskDefinition) -> str:
    """Digest of a task's definition and of its test episodes; "" where nothing was measured."""
    known = known_of(task)
    text = "" if known is None else f"{task.digest} test {known.episodes}"
    return text and hashlib.sha256(text.encode()).hexdigest()[:16]


def threshold(task: TaskDefinition) -> float | None:
    """The return of a score of 0.9, from which a task counts as solved; None if not known."""
    known = known_of(task)
    return None if known is None else round(known.scale.earned(SOLVED), 4)


@lru_cache(maxsize=4)
def read_known(path: Path = FILE) -> Entries:
    """The measured tasks of a file by name."""
    return json.loads(path.read_text(encoding="utf-8"))["tasks"]


def earned_in(content: Entries) -> Earned:
    """Return of a policy from an entry of a file; ValueError for a damaged one."""
    low, high = (None if content[end] is None else _number(content[end]) for end in ("low", "high"))
    failures = _number(content["failures"])
    returns = tuple(map(_number, content.get("returns", ())))
    cost = None if content.get("cost") is None else _number(content["cost"])
    value = _number(content["return"])
    return Earned(str(content["policy"]), value, low, high, failures, returns, cost)


def _number(given: object) -> float:
    if isinstance(given, bool) or not isinstance(given, int | float) or not math.isfinite(given):
        raise ValueError(f"{shown(given)} is no finite number")
    return float(given)


def bootstrapped(
    statistic: Callable[..., np.ndarray],
    returns: ArrayLike,
    zero: ArrayLike,
    one: ArrayLike,
    *,
    paired: bool,
) -> Interval:
    """A statistic of three mean returns with its percentile bootstrap interval over episodes.

    returns: of a policy [n]; zero, one: of the trivial policy and the best known [m], exact where
    m = 1. paired: all three were earned on the same episodes, n = m, which are drawn together, so
    that what the episodes differ by cancels. Deterministic; no interval from a single episode.
    """
    import numpy as np

    earned, low, high = (np.asarray(of, float) for of in (returns, zero, one))
    value = float(statistic(earned.mean(), low.mean(), high.mean()))
    n, m = earned.size, low.size
    if n < 2:
        return Interval(value)
    rng = np.random.default_rng(0)
    drawn = rng.integers(n, size=(RESAMPLES, n))
    known = drawn if paired else rng.integers(m, size=(RESAMPLES, m))
    means = earned[drawn].mean(1), low[known].mean(1), high[known].mean(1)
    ends = np.quantile(statistic(*means), [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Interval(value, *map(float, ends))
