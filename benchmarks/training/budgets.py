"""How much is trained on which task, and with what."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from benchmarks.tasks.learn import training_params as scaled
from stickslip.agents.biped.task import ANY_PHASE
from stickslip.agents.registry import machine_by_name
from stickslip.envs import Randomisation

if TYPE_CHECKING:
    from stickslip.agents.training.groups import LearningConfiguration
    from stickslip.envs import TaskDefinition

STRETCHES = 16
"""Evaluations of a training."""
SEEDS = (0, 1, 2, 3, 4)


class Budget(NamedTuple):
    """Of one trainer on the tasks of one machine."""

    timesteps: int
    """Of each seed."""
    seeds: tuple[int, ...] = SEEDS


BUDGETS = {
    ("jax", "biped"): Budget(8_000_000),
    ("jax", "ugv"): Budget(524_288),
    ("sb3", "biped"): Budget(1_048_576),
    ("sb3", "ugv"): Budget(131_072),
}
"""SB3's are smaller: what takes it about the processor time of JAX's."""


def training_params(task: TaskDefinition, params: Any, config: Any) -> Any:
    """The task's parameters with the training episodes of `stickslip train`.

    The biped's are short where every place is as good as another, begin at any phase and up to a
    higher crank rate, and fear slips and falls less: otherwise standing still is learnt. The UGV's
    rewards are scaled.
    """
    if task.machine == "ugv":
        return scaled(task, params)
    known: Any = task.parameters
    drawn = known.get("randomisation", {})
    fastest = max(drawn.get("crank_rate", (0.0,))[-1], config.start_rate)
    own = params.randomisation or Randomisation()
    starts = replace(own, phase=ANY_PHASE, crank_rate=(0.0, fastest))
    anywhere = "uniform" in known["scene"] and "mark" not in known
    short = {"time_limit": config.episode_time} if anywhere else {}
    return params.replace(
        randomisation=starts,
        slip_weight=min(known["slip_weight"], config.slip_weight),
        fall_penalty=min(known["fall_penalty"], config.fall_penalty),
        **short,
    )


def configuration(trainer: str, task: TaskDefinition, seed: int) -> LearningConfiguration:
    """The defaults of `stickslip train` for the task's machine, with the budget's steps; the
    biped's noise ends at 0.03, since its steps are a quarter of the default."""
    kind: Any = machine_by_name(task.machine).configuration
    steps = BUDGETS[trainer, task.machine].timesteps
    noise = {"final_noise": 0.03} if task.machine == "biped" else {}
    return kind.of(trainer=trainer, seed=seed, timesteps=steps, **noise)
