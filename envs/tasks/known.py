"""What is known of the scores on each task: known.json, read and held to its form."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from stickslip.dynamics.plain_checks import shown
from stickslip.envs.tasks.definition import TaskDefinition
from stickslip.envs.tasks.scale import Scale

if TYPE_CHECKING:
    from stickslip.envs.plain import Entries

FILE = Path(__file__).with_name("known.json")
FORMAT, VERSION = "stickslip known scores", 1
ACCEPTED = "accepted: the file as `python -m benchmarks.tasks` writes it"


@dataclass(frozen=True)
class Earned:
    """The mean return of a policy over a task's episodes; low, high: its 95 % interval, None where
    the task has one episode. failures: share of episodes that ended before their time."""

    policy: str
    value: float
    low: float | None
    high: float | None
    failures: float

    @property
    def spread(self) -> str:
        """What stands behind the value: half the interval and the failures, if there are any."""
        half = "" if self.high is None else f" ± {self.high - self.value:.2g}"
        return half + (f", {self.failures:.0%} fail" if self.failures else "")


@dataclass(frozen=True)
class Bound:
    """What no policy earns more than. reason: why, and what is assumed."""

    value: float
    reason: str


@dataclass(frozen=True)
class Learned:
    """What training earned over the same episodes. how: algorithm, settings, steps. returns: mean
    return of each seed's policy."""

    how: str
    returns: tuple[float, ...]


@dataclass(frozen=True)
class Known:
    """What was measured on a task, over the episodes of seeds 0, 1, ..., episodes - 1.

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
        """From returns to scores."""
        return Scale(self.trivial.value, self.best.value)

    @property
    def by_hand(self) -> Earned:
        """The best hand-written baseline."""
        return max(self.baselines, key=lambda one: one.value)


def known_of(task: TaskDefinition) -> Known | None:
    """What is known of a task; None where nothing was measured.

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
        trivial=_earned(content["trivial"]),
        baselines=tuple(map(_earned, content["baselines"])),
        planners=tuple(map(_earned, content["planners"])),
        best=_earned(content["best"]),
        how=str(content["how"]),
        bound=_bound(content["bound"]),
        learned=None if learned is None else _learned(learned),
        assumed=_bound(content.get("assumed")),
    )
    if known.bound is not None and not known.best.value <= known.bound.value:
        raise ValueError(f"best {known.best.value} above the bound {known.bound.value}")
    Scale(known.trivial.value, known.best.value)  # for its ValueError
    return known


def _bound(content: Entries | None) -> Bound | None:
    return None if content is None else Bound(_number(content["value"]), str(content["reason"]))


def _learned(content: Entries) -> Learned:
    return Learned(str(content["how"]), tuple(map(_number, content["returns"])))


def _earned(content: Entries) -> Earned:
    low, high = (None if content[end] is None else _number(content[end]) for end in ("low", "high"))
    failures = _number(content["failures"])
    return Earned(str(content["policy"]), _number(content["return"]), low, high, failures)


def _number(given: object) -> float:
    if isinstance(given, bool) or not isinstance(given, int | float) or not math.isfinite(given):
        raise ValueError(f"{shown(given)} is no finite number")
    return float(given)
