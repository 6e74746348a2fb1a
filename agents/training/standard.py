"""A configuration for machines that ask for nothing of their own."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.agents.training.configuration import group, later_group
from stickslip.agents.training.groups import (
    LearningConfiguration,
    PPOSettings,
    SHACSettings,
    require_whole_batches,
    shared,
)


@dataclass(frozen=True)
class StandardConfig(LearningConfiguration):
    """Training with PPO or SHAC. A machine's own configuration is a frozen dataclass on top, which
    says `machine`, changes defaults by `shared(name, default)` and adds fields by `entry`.
    """

    algorithm: str = shared("algorithm", "ppo")
    trainer: str = shared("trainer", "jax")
    seed: int = shared("seed", 0)
    timesteps: int = shared("timesteps", 1_000_000)

    num_envs: int = shared("num_envs", 64)
    learning_rate: float = shared("learning_rate", 1e-3)
    final_learning_rate: float = shared("final_learning_rate", 1e-4)
    discount: float = shared("discount", 0.99)
    batch_size: int = shared("batch_size", 512)
    hidden: int = shared("hidden", 64)
    layers: int = shared("layers", 2)
    threads: int = shared("threads", 1)
    ppo: PPOSettings = group(PPOSettings)
    shac: SHACSettings = later_group(SHACSettings)

    checkpoint_interval: int = shared("checkpoint_interval", 65_536)
    keep_checkpoints: int = shared("keep_checkpoints", 2)
    evaluation_episodes: int = shared("evaluation_episodes", 32)

    def _check_together(self) -> None:
        require_whole_batches(self)
