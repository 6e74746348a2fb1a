"""The trained policies of the package.

    python -m benchmarks.policies [--only NAME ...] [--runs DIR]
    python -m benchmarks.policies --measure [--only NAME ...]

Trains for each task named (default: those without a policy in the package) as `stickslip train`
does, with the settings and seeds recorded in the package's policy or else with USUAL, keeps the
policy of the best evaluation, measures it on the task's own episodes and puts it into the package
with its record; where it earns more than the best known, known.json is updated. Runs stay in
--runs, where they are resumed. --measure: measure the package's policies again.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.report import options, provenance
from benchmarks.tasks import EPISODES, beside_package, entry, played_on, put
from stickslip.agents.evaluation.rollout import is_random
from stickslip.agents.machine import machine_by_name, read_configuration
from stickslip.agents.policy import file
from stickslip.agents.policy.network import MLPPolicy
from stickslip.agents.policy.shipped import FOLDER, SUFFIX, policy_name, shipped_path
from stickslip.agents.training.configuration import Configuration, command_of
from stickslip.agents.training.directory import CONFIG, POLICY, read_columns, read_config
from stickslip.agents.training.run import best_evaluation, train
from stickslip.envs import TASKS, TaskDefinition, task_by_name
from stickslip.envs.tasks.known import FILE, read_known

RUNS = Path("runs/policies")
USUAL: dict[str, dict[str, Any]] = {
    "biped": {
        "start_rate": 5.0, "episode_time": 1.5, "slip_weight": 3.0, "fall_penalty": 1.0,
    },
    "ugv": {
        "failure": 10.0, "noise": 0.5, "final_noise": 0.05, "discount": 0.99,
        "random_start": (30.0, 150.0), "timesteps": 1_000_000,
    },
}  # fmt: skip
"""Settings for a task without a policy. The biped's episodes are short and penalise slips and falls
less than the task, or standing still is learnt; the UGV starts from any leg angles."""
SEEDS = (0, 1, 2)
COMPUTES = ("python", "stickslip", "jax", "jaxlib", "numpy", "optax")
"""Packages that training in JAX computes with."""
MACHINE = ("processor", "cores", "system")


class Run(NamedTuple):
    """A finished training. earned: by its best evaluation."""

    path: Path
    best_after: int
    earned: float


def configurations(task: TaskDefinition) -> list[Any]:
    """The configuration of the package's policy with each seed that was tried, else `usual`."""
    name = policy_name(task.name)
    trained: Any = {} if shipped_path(name) is None else file.record_of(name).trained
    if "config" in trained:
        config: Any = read_configuration(json.dumps(trained["config"]))
        return [replace(config, seed=seed) for seed in trained["seeds_tried"]]
    return usual(task)


def usual(task: TaskDefinition) -> list[Any]:
    """USUAL with each of SEEDS."""
    kind: Any = machine_by_name(task.machine).configuration
    settings = dict(USUAL[task.machine])
    scene, drawn = (str(task.parameters.get(name)) for name in ("scene", "randomisation"))
    if "patches" in scene:  # not every place is as good as another
        del settings["episode_time"]
    if task.choices.get("see_motion") is False or "robot" in drawn:
        settings |= {"history": 4, "start_rate": 6.0, "timesteps": 12_000_000}
    return [kind.of(task=task.name, seed=seed, **settings) for seed in SEEDS]


def best_of(task: TaskDefinition, folder: Path) -> Run:
    """The best run of all seeds."""
    runs = [trained(config, folder) for config in configurations(task)]
    for run in runs:
        print(f"{run.path}: {run.earned:.6g}, after {run.best_after:,} steps", flush=True)
    return max(runs, key=lambda run: run.earned)


def trained(config: Configuration, folder: Path) -> Run:
    """Train, or resume what is there."""
    path = folder / f"{config.task}-{config.digest}"
    print(command_of(config, str(path)), flush=True)
    begun = (path / CONFIG).exists()
    train(None if begun else config, path, resume=begun)
    return Run(path, *best_evaluation(path))


def put_into_package(task: TaskDefinition, run: Run, folder: Path = FOLDER) -> Path:
    """Write a run's policy with its record and what it earns on the task's own episodes."""
    config: Any = read_config(run.path)
    policy, about = file.read_policy(run.path / POLICY)
    record = {
        "config": json.loads(config.to_json()),
        "seeds_tried": [one.seed for one in configurations(task)],
        "timesteps": int(read_columns(run.path / "evaluations.csv")["timesteps"][-1]),
        "best_after": run.best_after,
    }
    return write(task, policy, record | computed_with(about["versions"]), folder)


def computed_with(versions: Any) -> dict[str, Any]:
    """Versions and machine of a training, as its record has them."""
    machine = provenance()["machine"]
    return {
        "versions": {name: versions[name] for name in COMPUTES if name in versions},
        "machine": {name: machine[name] for name in MACHINE},
    }


def write(task: TaskDefinition, policy: MLPPolicy, record: dict[str, Any], folder: Path) -> Path:
    """Measure a policy on the task's own episodes and write it into a folder under its name."""
    count = EPISODES[task.machine] if is_random(*task.make()) else 1
    earned = entry(task, policy_name(task.name), played_on(task, policy, count))
    earned.pop("policy")
    metadata = {
        "environment": task.environment,
        **file.named_task_entry(task),
        file.EARNED: {"episodes": count, **earned},
        file.TRAINED: record,
    }
    path = folder / (policy_name(task.name) + SUFFIX)
    return file.save_policy(policy, path, metadata, overwrite=True)


def main(arguments: list[str]) -> None:
    """Run the command."""
    parser = options("policies", __doc__)
    parser.add_argument("--only", nargs="+", metavar="NAME")
    parser.add_argument("--runs", type=Path, default=RUNS)
    parser.add_argument("--measure", action="store_true")
    given = parser.parse_args(arguments)
    there = [name for name in TASKS if shipped_path(policy_name(name)) is not None]
    asked = [name for name in TASKS if (name in there) == given.measure]
    for task in map(task_by_name, given.only or asked):
        name = policy_name(task.name)
        if given.measure:
            record = file.record_of(name)
            path = write(task, file.load_policy(record.path), record.trained, record.path.parent)
        else:
            path = put_into_package(task, best_of(task, given.runs))
        record = file.record_of(name)
        print(f"{path}: {path.stat().st_size} bytes, score {record.score}, {record.earned_return}")
        if (known := read_known(FILE).get(task.name)) is not None:
            put(task.name, beside_package(task, dict(known)))


if __name__ == "__main__":
    main(sys.argv[1:])
