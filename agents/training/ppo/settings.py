"""Settings of proximal policy optimisation: static sizes, and traced numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp

from stickslip.dynamics.checks import as_number, require_integer
from stickslip.dynamics.pytrees import register_pytree

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.agents.training.groups import LearningConfiguration

LEAST = {"rollout_steps": 2, "batch_size": 2}
MOST = {"num_envs": 65536, "epochs": 10_000, "hidden": 4096, "layers": 8}
"""As in a machine's configuration."""
POSITIVE = ("learning_rate", "noise", "final_noise", "clip_range")
SHARES = ("discount", "gae_lambda")


@dataclass(frozen=True)
class Sizes:
    """Static choices: the shapes of a program. `settings_of` takes a machine's configuration."""

    num_envs: int = 1024
    rollout_steps: int = 32
    """Of each environment, an update."""
    batch_size: int = 4096
    """Samples a gradient step; divides num_envs x rollout_steps."""
    epochs: int = 4
    """Passes over a rollout."""
    hidden: int = 64
    """Units a hidden layer, of the actor and of the critic."""
    layers: int = 2

    def __post_init__(self):
        for one in fields(self):
            low, high = LEAST.get(one.name, 1), MOST.get(one.name, 2**53)
            require_integer(one.name, getattr(self, one.name), low=low, high=high)
        if self.samples % self.batch_size:
            raise ValueError(
                f"batch_size = {self.batch_size} is not accepted; accepted: a divisor of num_envs "
                f"x rollout_steps = {self.samples}"
            )

    @property
    def samples(self) -> int:
        """Steps an update."""
        return self.num_envs * self.rollout_steps


class Now(NamedTuple):
    """Numbers that change during training."""

    learning_rate: Float[Array, ""]
    noise: Float[Array, ""]


@register_pytree
@dataclass(frozen=True)
class Rates:
    """Numbers, which compile nothing again: each may be an array of a population's [members].

    The learning rate goes linearly from its first to its last value, the noise geometrically.
    """

    learning_rate: Float[Array, ""] | float = 1e-3
    final_learning_rate: Float[Array, ""] | float = 1e-4
    noise: Float[Array, ""] | float = 0.22
    """Standard deviation of exploration, the largest action being 1."""
    final_noise: Float[Array, ""] | float = 0.03
    discount: Float[Array, ""] | float = 0.99
    """Of rewards, per control step."""
    gae_lambda: Float[Array, ""] | float = 0.95
    clip_range: Float[Array, ""] | float = 0.2

    def at(self, share: Float[Array, ""]) -> Now:
        """share: of the training done so far, 0 to 1."""
        share = jnp.clip(share, 0.0, 1.0)
        rates, noises = (
            (self.learning_rate, self.final_learning_rate),
            (jnp.log(self.noise), jnp.log(self.final_noise)),
        )
        rate, noise = (first + (last - first) * share for first, last in (rates, noises))
        return Now(rate, jnp.exp(noise))

    def validate(self) -> Rates:
        """These with lists as arrays, or ValueError naming what is no such number."""
        found = {}
        for one in fields(self):
            strict, high = one.name in POSITIVE, 1.0 if one.name in SHARES else math.inf
            accepted = "0 to 1" if one.name in SHARES else f"finite, {'>' if strict else '>='} 0"
            rule = {"low": 0.0, "strict": strict, "high": high, "accepted": accepted}
            found[one.name] = as_number(one.name, getattr(self, one.name), **rule)
        return replace(self, **found)


def settings_of(config: LearningConfiguration) -> tuple[Sizes, Rates]:
    """Settings of a training configuration."""
    ppo = config.ppo
    sizes = Sizes(
        num_envs=config.num_envs,
        rollout_steps=ppo.rollout_steps,
        batch_size=config.batch_size,
        epochs=ppo.epochs,
        hidden=config.hidden,
        layers=config.layers,
    )
    rates = Rates(
        learning_rate=config.learning_rate,
        final_learning_rate=config.final_learning_rate,
        noise=ppo.noise,
        final_noise=ppo.final_noise,
        discount=config.discount,
        gae_lambda=ppo.gae_lambda,
        clip_range=ppo.clip_range,
    )
    return sizes, rates
