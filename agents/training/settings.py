"""Settings that machines share: groups for one algorithm each, fields by name, a standard set."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, ClassVar, TypeVar

from stickslip.agents.training.configuration import (
    Configuration,
    Settings,
    entry,
    group,
)
from stickslip.agents.untrusted import LARGEST, LARGEST_TEXT
from stickslip.dynamics.plain_checks import require_memory

T = TypeVar("T")
MOST_STEPS = 10**12 - 1
"""Largest step count in the name of a checkpoint."""
RESIDUALS = 20_000
"""About how many bytes of a step the derivative keeps (the biped's, 42 MB for 128 x 16)."""


@dataclass(frozen=True)
class PPOSettings(Settings):
    """Of proximal policy optimisation."""

    rollout_steps: int = entry(128, int, "steps of each environment an update", low=2)
    epochs: int = entry(6, int, "passes over a rollout", low=1, high=10_000)
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
    gradient_steps: int = entry(8, int, "gradient steps a step of all", low=1, high=10_000)
    soft_update: float = entry(0.005, float, "tau of the target network", low=0, high=1)


@dataclass(frozen=True)
class SHACSettings(Settings):
    """Of short-horizon actor-critic, whose gradients go through the simulator."""

    horizon: int = entry(16, int, "steps of a window that derivatives go through", low=2, high=4096)
    critic_passes: int = entry(4, int, "of the critic over a window", low=1, high=10_000)
    critic_pace: float = entry(1.0, float, "the critic's learning rate, in the actor's", low=0)
    td_lambda: float = entry(0.95, float, "of the critic's targets", low=0, high=1)
    target_memory: float = entry(0.2, float, "what the target keeps an update", low=0, high=1)
    action_noise: float = entry(0.2, float, "standard deviation of exploration", low=0, strict=True)
    final_action_noise: float = entry(0.05, float, "the same at the end", low=0, strict=True)


ALGORITHMS_OF = {"jax": ("ppo", "shac"), "sb3": ("ppo", "sac")}
"""By trainer."""


@dataclass(frozen=True)
class LearningConfiguration(Configuration):
    """Training with PPO or SHAC. A machine's own configuration is a frozen dataclass on top, which
    says `machine`, changes defaults by `shared(name, default)` and adds fields by `entry`.
    """

    algorithm: str = entry("ppo", str, "learning algorithm", choices=("ppo", "shac"))
    trainer: str = entry(
        "jax", str, "what learns, JAX or Stable-Baselines3", choices=("jax", "sb3")
    )
    seed: int = entry(0, int, "of everything random", low=0, high=2**31 - 1)
    timesteps: int = entry(1_000_000, int, "control steps in all", low=1, high=MOST_STEPS)

    num_envs: int = entry(64, int, "environments side by side", low=1, high=65536)
    learning_rate: float = entry(1e-3, float, "at the beginning", low=0, strict=True)
    final_learning_rate: float = entry(1e-4, float, "at the end", low=0)
    discount: float = entry(0.99, float, "gamma, per control step", low=0, high=1)
    batch_size: int = entry(512, int, "samples a gradient step", low=2)
    hidden: int = entry(64, int, "units a hidden layer", low=1, high=4096)
    layers: int = entry(2, int, "hidden layers", low=1, high=8)
    threads: int = entry(1, int, "sb3: of PyTorch", low=1, high=256)
    ppo: PPOSettings = group(PPOSettings)
    shac: SHACSettings = group(SHACSettings)

    checkpoint_interval: int = entry(
        65_536, int, "steps to the next checkpoint", low=1, high=MOST_STEPS
    )
    keep_checkpoints: int = entry(2, int, "of the latest, beside the best", low=1)
    evaluation_episodes: int = entry(32, int, "episodes an evaluation", low=1, high=65536)

    if TYPE_CHECKING:
        sac: SACSettings = group(SACSettings)  # where the algorithms have it

    FLAGS: ClassVar = (
        "task",
        "algorithm",
        "trainer",
        "seed",
        "timesteps",
        "num_envs",
        "learning_rate",
    )

    def __post_init__(self):
        super().__post_init__()
        if self.algorithm not in ALGORITHMS_OF[self.trainer]:
            (other,) = (name for name in ALGORITHMS_OF if name != self.trainer)
            own = " or ".join(map(repr, ALGORITHMS_OF[self.trainer]))
            raise ValueError(
                f"trainer = {self.trainer!r} with algorithm = {self.algorithm!r}; accepted: "
                f"{other!r}, or algorithm = {own}"
            )

    def _check_together(self) -> None:
        require_whole_batches(self)


def shared(name: str, default: T) -> T:
    """The field of LearningConfiguration of that name, with a machine's own default."""
    rules = {one.name: one.metadata for one in fields(LearningConfiguration)}
    return field(default=default, metadata=rules[name])


def task_field() -> str | None:
    """The field of a named task, for machines that have tasks."""
    about = "of `stickslip tasks`; it says all of what is trained on"
    return entry(None, str, about, optional=True)


def steps_an_update(config: LearningConfiguration) -> tuple[str, int]:
    """Steps of each environment in an update, and the setting that decides them."""
    if config.algorithm == "shac":
        return "horizon", config.shac.horizon
    return "rollout_steps", config.ppo.rollout_steps


def require_whole_batches(config: LearningConfiguration) -> None:
    """Raise ValueError unless batches divide a rollout of the configuration."""
    name, steps = steps_an_update(config)
    rollout = config.num_envs * steps
    if config.batch_size > rollout or rollout % config.batch_size:
        raise ValueError(
            f"batch_size = {config.batch_size} is not accepted; accepted: a divisor of "
            f"num_envs x {name} = {rollout}"
        )


def require_room(config: LearningConfiguration, observation: int) -> None:
    """Raise ValueError for networks that no policy file holds, and for samples that no memory does.

    observation: about how many numbers an observation has.
    """
    widths = [observation, *[config.hidden] * config.layers, 2]
    size = 4 * sum((one + 1) * other for one, other in itertools.pairwise(widths))
    if size > LARGEST - 2 * LARGEST_TEXT:
        raise ValueError(
            f"hidden = {config.hidden} with layers = {config.layers} makes a policy of {size:,} "
            f"bytes; accepted: what fits a policy file, {LARGEST:,} bytes"
        )
    if config.algorithm == "sac":
        given, samples = f"buffer_size = {config.sac.buffer_size}", config.sac.buffer_size
    else:
        name, steps = steps_an_update(config)
        given = f"num_envs = {config.num_envs} with {name} = {steps}"
        samples = config.num_envs * steps
    each = 8 * (observation + 8) + (RESIDUALS if config.algorithm == "shac" else 0)
    require_memory(given, "samples", samples, each)
    given = f"batch_size = {config.batch_size} with hidden = {config.hidden}"
    wide = 2 * (observation + config.hidden * config.layers)  # forwards and back
    require_memory(given, "samples of a gradient step", config.batch_size, 4 * wide)
