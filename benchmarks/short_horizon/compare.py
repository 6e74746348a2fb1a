"""Algorithms at equal wall-clock time: what their policies earn after so much of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benchmarks.tasks.measure import EPISODES, rounded
from benchmarks.training.budgets import training_params
from benchmarks.training.measure import Stopwatch
from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.evaluation.run import is_random, play
from stickslip.agents.evaluation.standard import keep_of
from stickslip.agents.registry import machine_by_name
from stickslip.agents.training.trainer import trainer_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.policy.mlp import MLPPolicy
    from stickslip.agents.training.trainer import AnyTrainer
    from stickslip.envs import TaskDefinition

TASKS = ("BipedSteady-v0", "BipedSlippery-v0", "UGVRandomBumps-v0")
ALGORITHMS = ("ppo", "shac", "sac")
SECONDS = {"biped": 16.0, "ugv": 5.0}
"""Of learning, each seed."""
SEEDS = (0, 1, 2)
POINTS = 8
"""Evaluations of a training."""
TRIAL = 1.5
"""Seconds in which the speed is found that the course of noise and learning rate is laid out by."""
CHANGES: dict[tuple[str, str], dict[str, Any]] = {
    ("ppo", "biped"): {"final_noise": 0.03},
}
"""Where settings differ from the defaults of `stickslip train`."""


def offered(task: TaskDefinition, algorithm: str) -> bool:
    """Whether an algorithm is there for a task's machine."""
    return algorithm != "sac" or task.machine == "biped"


def measure(algorithm: str, task: TaskDefinition, say: Callable[[str], None]) -> dict[str, Any]:
    """The entry of the results: returns [seeds, points], steps and seconds of learning [points]."""
    kind: Any = machine_by_name(task.machine).configuration
    env, params = task.make("same_step")
    test, seen = without_resets(env), range(EPISODES[task.machine] if is_random(params) else 1)
    limit = SECONDS[task.machine]

    def earned(policy: MLPPolicy) -> float:
        return rounded(float(play(test, policy, params, seen, keep_of).reward.mean()))

    def trainer_for(seed: int, timesteps: int) -> AnyTrainer:
        changes = CHANGES.get((algorithm, task.machine), {})
        config = kind.of(algorithm=algorithm, seed=seed, timesteps=timesteps, **changes)
        given = training_params(task, params, config)
        return trainer_of(config)(config, env, given, lambda update: None, lambda: False)

    trial = trainer_for(99, 10**9)
    begun, speed = Stopwatch(), Stopwatch()
    begun.start()
    trial.begin_stretch(0)
    trial.advance(1)  # compiles
    begun.stop()
    before = trial.timesteps
    _advance(trial, speed, TRIAL)
    timesteps = round((trial.timesteps - before) / speed.wall * limit)
    trial.close()
    say(f"compiled in {begun.processor:.0f} processor s; {timesteps / limit:,.0f} steps/s")
    found: dict[str, list[Any]] = {"returns": [], "steps": [], "seconds": [], "processor": []}
    for seed in SEEDS:
        trainer, watch, rows = trainer_for(seed, timesteps), Stopwatch(), []
        trainer.begin_stretch(0)
        for point in range(POINTS):
            _advance(trainer, watch, limit * (point + 1) / POINTS)
            rows.append((earned(trainer.policy()), trainer.timesteps, watch.wall, watch.processor))
        trainer.close()
        for name, column in zip(found, zip(*rows, strict=True), strict=True):
            found[name].append([round(one, 4) for one in column])
        say(f"seed {seed}: {trainer.timesteps:,} steps, {rows[-1][0]:.5g}")
    compiled = round(begun.processor, 1)
    return {"digest": task.digest, "limit": limit, "compile_processor_seconds": compiled, **found}


def _advance(trainer: AnyTrainer, watch: Stopwatch, until: float) -> None:
    """Learn until the watch shows so many seconds, update by update."""
    while watch.wall < until:
        watch.start()
        trainer.advance(trainer.timesteps + 1)
        watch.stop()
