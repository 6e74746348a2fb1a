"""One trainer on one task: what its policies earn as training goes on, and what that took."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from benchmarks.tasks.measure import EPISODES, rounded
from benchmarks.training.budgets import BUDGETS, STRETCHES, configuration, training_params
from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.evaluation.run import is_random, play
from stickslip.agents.evaluation.standard import keep_of
from stickslip.agents.training.ppo import settings_of, train_population
from stickslip.agents.training.trainer import trainer_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.policy.mlp import MLPPolicy
    from stickslip.agents.training.ppo import Population
    from stickslip.envs import TaskDefinition


class Stopwatch:
    """Wall-clock and processor time of learning, evaluations aside; starts stopped."""

    def __init__(self) -> None:
        self.wall, self.processor, self._since = 0.0, 0.0, (0.0, 0.0)

    def start(self) -> None:
        """A stretch begins."""
        self._since = time.perf_counter(), time.process_time()

    def stop(self) -> None:
        """It ends."""
        self.wall += time.perf_counter() - self._since[0]
        self.processor += time.process_time() - self._since[1]


def measure(trainer: str, task: TaskDefinition, say: Callable[[str], None]) -> dict[str, Any]:
    """The entry of benchmarks/results/training.json; see __main__.py for its form."""
    budget = BUDGETS[trainer, task.machine]
    config = configuration(trainer, task, 0)
    env, params = task.make("same_step")
    test, seen = without_resets(env), range(EPISODES[task.machine] if is_random(params) else 1)

    def earned(policy: MLPPolicy) -> float:
        return rounded(float(play(test, policy, params, seen, keep_of).reward.mean()))

    train = _by_population if trainer == "jax" else _one_by_one
    curve = train(task, earned, say)
    return {
        "digest": task.digest,
        "seeds": list(budget.seeds),
        "timesteps": budget.timesteps,
        "config": config.digest,
        **curve,
    }


def _by_population(
    task: TaskDefinition, earned: Callable[[MLPPolicy], float], say: Callable[[str], None]
) -> dict[str, Any]:
    """All seeds side by side on one core, which is one program; each has its share of the time."""
    budget, (env, params) = BUDGETS["jax", task.machine], task.make("same_step")
    config = configuration("jax", task, 0)
    settings = settings_of(config)
    given = env, training_params(task, params, config), settings, budget.seeds
    begun = Stopwatch()
    begun.start()
    train_population(*given, timesteps=settings[0].samples, cores=1)  # compiles
    begun.stop()
    watch, rows = Stopwatch(), []

    def tell(now: Population) -> None:
        watch.stop()
        returns = [earned(now.policy(member)) for member in range(len(budget.seeds))]
        rows.append((now.timesteps, watch.wall, watch.processor, returns))
        best, worst = max(returns), min(returns)
        say(f"{now.timesteps:>10,} steps  {watch.processor:6.1f} s  {worst:.5g} to {best:.5g}")
        watch.start()

    watch.start()
    train_population(*given, timesteps=budget.timesteps, stretches=STRETCHES, tell=tell, cores=1)
    steps, wall, processor, returns = zip(*rows, strict=True)
    return {
        "steps": list(steps),
        "seconds": [round(one / len(budget.seeds), 3) for one in wall],
        "processor_seconds": [round(one / len(budget.seeds), 3) for one in processor],
        "first_update": {"wall": round(begun.wall, 1), "processor": round(begun.processor, 1)},
        "returns": [list(one) for one in zip(*returns, strict=True)],
    }


def _one_by_one(
    task: TaskDefinition, earned: Callable[[MLPPolicy], float], say: Callable[[str], None]
) -> dict[str, Any]:
    """A training after the other; times are means over the seeds."""
    budget, (env, params) = BUDGETS["sb3", task.machine], task.make("same_step")
    goals = [budget.timesteps * (part + 1) // STRETCHES for part in range(STRETCHES)]
    found, times, steps = [], [], []
    for seed in budget.seeds:
        config = configuration("sb3", task, seed)
        kind = trainer_of(config)
        trainer = kind(config, env, training_params(task, params, config), _ignore, _never)
        watch, returns, passed, made = Stopwatch(), [], [], []
        try:
            trainer.begin_stretch(0)
            for goal in goals:
                if trainer.timesteps < goal:
                    watch.start()
                    trainer.advance(goal)
                    watch.stop()
                returns.append(earned(trainer.policy()))
                passed.append((watch.wall, watch.processor))
                made.append(trainer.timesteps)
                say(f"{made[-1]:>10,} steps  {watch.processor:6.1f} s  {returns[-1]:.5g}")
        finally:
            trainer.close()
        found.append(returns)
        times.append(passed)
        steps = made
    means = [
        [sum(one) / len(one) for one in zip(*at, strict=True)] for at in zip(*times, strict=True)
    ]
    return {
        "steps": steps,
        "seconds": [round(wall, 3) for wall, _ in means],
        "processor_seconds": [round(processor, 3) for _, processor in means],
        "returns": found,
    }


def _ignore(update: object) -> None:
    del update


def _never() -> bool:
    return False
