"""Records of the package's policies: how each was trained, and what it earned."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

from stickslip.agents.machine import read_configuration
from stickslip.agents.policy.file import named_task_of, read_policy
from stickslip.agents.policy.shipped import no_policy, shipped_names, shipped_path
from stickslip.agents.training.configuration import command_of
from stickslip.dynamics.checks import shown
from stickslip.envs.tasks.definition import WITHDRAWN
from stickslip.envs.tasks.known import earned_in, known_of

if TYPE_CHECKING:
    from pathlib import Path

    from stickslip.agents.untrusted import Json
    from stickslip.envs.tasks.definition import TaskDefinition
    from stickslip.envs.tasks.known import Interval

EARNED, TRAINED = "earned", "trained"
"""Entries of the metadata."""


@dataclass(frozen=True)
class Record:
    """Training and score of a policy of the package.

    earned: over the task's own episodes: policy, return, low, high (None for a single episode),
    failures, returns. trained: config, timesteps, best_after, versions, machine.
    """

    name: str
    """Name as given by the caller."""
    path: Path
    task: TaskDefinition
    layer_sizes: tuple[int, ...]
    earned: dict[str, Json]
    trained: dict[str, Json]

    @property
    def earned_return(self) -> float:
        """Mean over the episodes."""
        return float(str(self.earned["return"]))

    @property
    def score(self) -> Interval | None:
        """Normalised score; None where nothing is known of the task."""
        known = known_of(self.task)
        return None if known is None else known.score_of(earned_in({"policy": "", **self.earned}))

    @property
    def command(self) -> str:
        """Command that trains it again; where it is `carried_over`, on its task of today."""
        config: dict[str, Json] = {**self._config, "task": self.task.name}
        return command_of(read_configuration(json.dumps(config)))

    @property
    def carried_over(self) -> bool:
        """True if it was trained on a withdrawn version of its task and measured on this one."""
        return self._config.get("task") in WITHDRAWN

    @property
    def _config(self) -> dict[str, Json]:
        config = self.trained["config"]
        return config if isinstance(config, dict) else {}


def record_of(name: str) -> Record:
    """The record of a policy of the package. ValueError for an unknown name or a damaged file."""
    path = shipped_path(name)
    if path is None:
        raise ValueError(no_policy(name))
    policy, metadata = read_policy(path)
    task = named_task_of(metadata)
    earned, trained = metadata.get(EARNED), metadata.get(TRAINED)
    if task is None or not isinstance(earned, dict) or not isinstance(trained, dict):
        raise ValueError(
            f"{path}: it lacks its task or its record; accepted: as `python -m benchmarks.policies`"
            f" writes it, not {shown(sorted(metadata))}"
        )
    trained = {entry: one for entry, one in trained.items() if entry != "command"}
    return Record(name, path, task, policy.layer_sizes, earned, trained)


def every_record() -> list[Record]:
    """Records of all policies of the package."""
    return [record_of(name) for name in shipped_names()]
