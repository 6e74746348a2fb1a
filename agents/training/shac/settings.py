"""Settings of short-horizon actor-critic: static sizes, and traced numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from stickslip.agents.training.ppo.settings import Rates, Sizes
from stickslip.dynamics.pytrees import register_pytree

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.agents.training.groups import LearningConfiguration


@dataclass(frozen=True)
class ShortSizes(Sizes):
    """Static choices, as PPO's: `rollout_steps` is the window through which derivatives go, of
    `epochs` and `batch_size` the critic's passes over it are made."""

    num_envs: int = 128
    rollout_steps: int = 16
    batch_size: int = 512
    epochs: int = 4


@register_pytree
@dataclass(frozen=True)
class ShortRates(Rates):
    """Numbers, as PPO's: `gae_lambda` is that of the critic's TD(lambda), `clip_range` is not used.

    The learning rate is the actor's.
    """

    critic_pace: Float[Array, ""] | float = 1.0
    """The critic's learning rate, in the actor's."""
    target_memory: Float[Array, ""] | float = 0.2
    """Of the target critic, what stays of it in an update."""


def settings_of(config: LearningConfiguration) -> tuple[ShortSizes, ShortRates]:
    """Settings of a training configuration."""
    shac = config.shac
    sizes = ShortSizes(
        num_envs=config.num_envs,
        rollout_steps=shac.horizon,
        batch_size=config.batch_size,
        epochs=shac.critic_passes,
        hidden=config.hidden,
        layers=config.layers,
    )
    rates = ShortRates(
        learning_rate=config.learning_rate,
        final_learning_rate=config.final_learning_rate,
        noise=shac.action_noise,
        final_noise=shac.final_action_noise,
        discount=config.discount,
        gae_lambda=shac.td_lambda,
        critic_pace=shac.critic_pace,
        target_memory=shac.target_memory,
    )
    return sizes, rates
