"""The settings of one algorithm each, as groups of a configuration. Machines share them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from stickslip.agents.training.configuration import Settings, entry


@dataclass(frozen=True)
class PPOSettings(Settings):
    """Of proximal policy optimisation."""

    rollout_steps: int = entry(128, int, "steps of each environment an update", low=2)
    epochs: int = entry(6, int, "passes over a rollout", low=1)
    gae_lambda: float = entry(0.95, float, "of the advantage estimate", low=0, high=1)
    clip_range: float = entry(0.2, float, "of the probability ratio", low=0, strict=True)
    noise: float = entry(
        0.22,
        float,
        "standard deviation of exploration, the largest action being 1",
        low=0,
        strict=True,
    )
    final_noise: float = entry(0.03, float, "the same at the end", low=0, strict=True)


@dataclass(frozen=True)
class SACSettings(Settings):
    """Of soft actor-critic."""

    buffer_size: int = entry(300_000, int, "transitions remembered", low=1)
    learning_starts: int = entry(10_000, int, "random steps beforehand", low=0)
    gradient_steps: int = entry(8, int, "gradient steps a step of all", low=1)
    soft_update: float = entry(0.005, float, "tau of the target network", low=0, high=1)


def require_whole_batches(config: Any) -> None:
    """Raise ValueError unless PPO's batches divide a rollout of the configuration."""
    rollout = config.num_envs * config.ppo.rollout_steps
    if config.batch_size > rollout or rollout % config.batch_size:
        raise ValueError(
            f"batch_size = {config.batch_size} is not accepted; accepted: a divisor of "
            f"num_envs x rollout_steps = {rollout}"
        )
