"""The package's trained policies: their names, and records of how they were trained.

The policy of BipedIce-v0 is the file biped-ice-v0.npz; "biped-ice" is that of the latest version.
Names are read without JAX, so that help is quick.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from stickslip.dynamics.plain_checks import nearest, shown
from stickslip.envs.tasks.definition import TASKS, WITHDRAWN, TaskDefinition

if TYPE_CHECKING:
    from stickslip.agents.untrusted import Json
    from stickslip.envs.tasks.known import Interval

FOLDER = Path(__file__).parent / "trained"
SUFFIX = ".npz"
WORDS = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
"""Boundaries of words in a task's name: Biped|Ice|Seen, UGV|Low|Grip."""
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,99}")
"""Pattern of a name; anything else is a path."""
VERSIONED = re.compile(r"(.+)-v(\d{1,6})")
EARNED, TRAINED = "earned", "trained"
"""Entries of the metadata."""


def policy_name(task: str) -> str:
    """The full name of a task's policy: "biped-ice-v0" of "BipedIce-v0"."""
    return WORDS.sub("-", task).lower()


def shipped_names(folder: Path = FOLDER) -> tuple[str, ...]:
    """Names of the policies without their versions, in the order of the ladder."""
    order = [_stem(policy_name(task)) for task in TASKS]
    found = {_stem(path.stem) for path in folder.glob(f"*{SUFFIX}")}
    known = [name for name in dict.fromkeys(order) if name in found]
    return (*known, *sorted(found - set(known)))


def shipped_titles() -> dict[str, str]:
    """Titles of the policies' tasks, by the policies' names."""
    titles = {_stem(policy_name(task.name)): task.title for task in TASKS.values()}
    return {name: titles.get(name, "") for name in shipped_names()}


def shipped_path(name: str, folder: Path = FOLDER) -> Path | None:
    """The file of a name, the latest one where it has no version; None where there is none.

    The task's own name is accepted, too.
    """
    if not NAME.fullmatch(name):
        return None
    plain = policy_name(name)
    found = {path.stem: path for path in folder.glob(f"*{SUFFIX}")}
    if plain in found:
        return found[plain]
    versions = [one for one in found if _stem(one) == plain]
    return found[max(versions, key=_version)] if versions else None


def no_policy(name: str) -> str:
    """The message for a word that is neither a policy of the package nor a file."""
    names = shipped_names()
    return (
        f"{name!r} is neither a policy of the package nor a file; accepted: {', '.join(names)}, a "
        f"policy file, or the directory of a run with one{nearest(policy_name(name), names)}"
    )


def _stem(name: str) -> str:
    match = VERSIONED.fullmatch(name)
    return name if match is None else match.group(1)


def _version(name: str) -> int:
    match = VERSIONED.fullmatch(name)
    return -1 if match is None else int(match.group(2))


@dataclass(frozen=True)
class Record:
    """How a policy of the package was trained, and what it earned.

    earned: over the task's own episodes: policy, return, low, high (None for a single episode),
    failures, returns. trained: config, timesteps, best_after, versions, machine.
    """

    name: str
    """As it was asked for."""
    path: Path
    task: TaskDefinition
    layer_sizes: tuple[int, ...]
    earned: dict[str, Json]
    trained: dict[str, Json]

    @property
    def short_name(self) -> str:
        """Without the version, where this is the latest."""
        stem = _stem(self.path.stem)
        return stem if shipped_path(stem, self.path.parent) == self.path else self.path.stem

    @property
    def earned_return(self) -> float:
        """Mean over the episodes."""
        return float(str(self.earned["return"]))

    @property
    def score(self) -> Interval | None:
        """Normalised score; None where nothing is known of the task."""
        from stickslip.envs.tasks.known import earned_in, known_of

        known = known_of(self.task)
        return None if known is None else known.score_of(earned_in({"policy": "", **self.earned}))

    @property
    def command(self) -> str:
        """Command that trains it again; where it is `carried_over`, on its task of today."""
        from stickslip.agents.registry import read_configuration
        from stickslip.agents.training.command_line import command_of

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
    from stickslip.agents.policy.file import named_task_of, read_policy

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
    """Of all policies of the package."""
    return [record_of(name) for name in shipped_names()]
