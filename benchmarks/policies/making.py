"""A policy of the package: trained by `stickslip train`, cut down to what is shipped."""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from benchmarks.policies.recipes import configuration, recipe_of
from benchmarks.report import provenance
from benchmarks.tasks.measure import EPISODES, entry, played_on
from stickslip.agents.evaluation.evaluate import is_random
from stickslip.agents.foreign.reading import read_text
from stickslip.agents.policy.file import load_policy, save_policy
from stickslip.agents.shipped.definition import named_task_entry
from stickslip.agents.shipped.names import FOLDER, SUFFIX, policy_name
from stickslip.agents.shipped.record import EARNED, TRAINED
from stickslip.agents.training.command_line import command_of
from stickslip.agents.training.directory import CONFIG, VERSIONS, read_config
from stickslip.agents.training.metrics import read_columns
from stickslip.agents.training.run import best_evaluation

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.policy.mlp import MLPPolicy
    from stickslip.agents.shipped.record import Record
    from stickslip.agents.training.configuration import Configuration
    from stickslip.envs import TaskDefinition

COMPUTES = ("python", "stickslip", "jax", "jaxlib", "numpy", "optax")
"""Of a run's versions: what training in JAX computes with."""
MACHINE = ("processor", "cores", "system")


class Run(NamedTuple):
    """A finished training. earned: by its best evaluation, over episodes that neither training nor
    the task's own scores see."""

    path: Path
    best_after: int
    earned: float


def best_of(task: TaskDefinition, folder: Path, say: Callable[[str], None]) -> Run:
    """The best run of the recipe's seeds; what is in the folder already is not trained again."""
    runs = [trained(configuration(task, seed), folder, say) for seed in recipe_of(task).seeds]
    for run in runs:
        say(f"{run.path}: {run.earned:.6g}, after {run.best_after:,} steps")
    return max(runs, key=lambda run: run.earned)


def trained(config: Configuration, folder: Path, say: Callable[[str], None]) -> Run:
    """Train by the command that a user would give, or take what it left there before."""
    path = folder / f"{config.task}-{config.digest}"
    if not _is_finished(path, config.timesteps):
        goes_on = (path / CONFIG).exists()
        command = command_of(config, str(path))
        say(command)
        words = ["train", "--out", str(path), "--resume"] if goes_on else shlex.split(command)[1:]
        run_command([*words, "--no-pictures"])
    return Run(path, *best_evaluation(path))


def run_command(words: list[str]) -> None:
    """`stickslip` with these words, as a process of its own."""
    subprocess.run([sys.executable, "-m", "stickslip.cli", *words], check=True)


def _is_finished(path: Path, timesteps: int) -> bool:
    table = path / "evaluations.csv"
    steps = read_columns(table).get("timesteps", []) if table.exists() else []
    return bool(steps) and steps[-1] >= timesteps


def put_into_package(task: TaskDefinition, run: Run, folder: Path = FOLDER) -> Path:
    """Measure a run's policy on the task's own episodes and write it with its record."""
    return _written(task, load_policy(run.path / "policy.npz"), _record(task, run), folder)


def measure_again(record: Record) -> Path:
    """Measure a policy of the package on its task's own episodes, and write what it earns there."""
    return _written(record.task, load_policy(record.path), record.trained, record.path.parent)


def _written(
    task: TaskDefinition, policy: MLPPolicy, trained: dict[str, Any], folder: Path
) -> Path:
    metadata = {
        "environment": task.environment,
        **named_task_entry(task),
        EARNED: earned_on(task, policy),
        TRAINED: trained,
    }
    path = folder / (policy_name(task.name) + SUFFIX)
    return save_policy(policy, path, metadata, overwrite=True)


def earned_on(task: TaskDefinition, policy: MLPPolicy) -> dict[str, Any]:
    """What a policy earns on the task's own episodes."""
    count = EPISODES[task.machine] if is_random(task.make()[1]) else 1
    played = played_on(task, policy, count)
    row = entry(policy_name(task.name), played.reward, played.fell)
    return {"episodes": count} | {name: one for name, one in row.items() if name != "policy"}


def _record(task: TaskDefinition, run: Run) -> dict[str, Any]:
    config: Any = read_config(run.path)
    versions, machine = json.loads(read_text(run.path / VERSIONS)), provenance()["machine"]
    return {
        "config": json.loads(config.to_json()),
        "seeds_tried": list(recipe_of(task).seeds),
        "timesteps": int(read_columns(run.path / "evaluations.csv")["timesteps"][-1]),
        "best_after": run.best_after,
        "versions": {name: versions[name] for name in COMPUTES if name in versions},
        "machine": {name: machine[name] for name in MACHINE},
    }


def same_policy(one: MLPPolicy, other: MLPPolicy) -> bool:
    """Whether two policies are the same to the last bit."""
    names = ("activation", "squash", "observation_clip", "layer_sizes")
    alike = all(getattr(one, name) == getattr(other, name) for name in names)
    pairs = [*zip(one.weights, other.weights, strict=False)]
    pairs += [*zip(one.biases, other.biases, strict=False)]
    pairs += [(one.shift, other.shift), (one.scale, other.scale)]
    return alike and all(np.array_equal(a, b) for a, b in pairs)
