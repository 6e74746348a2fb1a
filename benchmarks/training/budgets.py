"""How much is trained on which task, and with what."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from stickslip.agents.registry import machine_by_name

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
    ("jax", "biped"): Budget(4_194_304),
    ("jax", "ugv"): Budget(1_048_576),
    ("sb3", "biped"): Budget(1_048_576, SEEDS[:3]),
    ("sb3", "ugv"): Budget(262_144, SEEDS[:3]),
}
"""SB3's are smaller: what takes about the time that JAX takes for all its seeds."""
COMPARED = ("BipedSteady-v0", "BipedThrift-v0", "UGVRandomBumps-v0")
"""Tasks on which SB3 is measured, too, where none are named."""


def configuration(trainer: str, task: TaskDefinition, seed: int) -> LearningConfiguration:
    """The defaults of `stickslip train` for the task's machine, with the budget's steps."""
    kind: Any = machine_by_name(task.machine).configuration
    steps = BUDGETS[trainer, task.machine].timesteps
    return kind.of(trainer=trainer, seed=seed, timesteps=steps)
