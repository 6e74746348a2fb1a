"""The configuration of the biped's training runs: every number of it, as a flag and as JSON."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from stickslip.agents.biped.scenes import SCENE, SCENES
from stickslip.agents.foreign.reading import LARGEST_TEXT
from stickslip.agents.training import configuration as config_fields
from stickslip.agents.training.configuration import (
    Configuration,
    entry,
    every_field,
    group,
    rule_of,
)
from stickslip.agents.training.groups import PPOSettings, SACSettings, require_whole_batches
from stickslip.dynamics.plain_checks import require_memory

if TYPE_CHECKING:
    import argparse
    from collections.abc import Mapping

ALGORITHMS = ("ppo", "sac")

MOST_STEPS = 10**12 - 1
"""What the name of a checkpoint has room for."""
BIPED_OBSERVATION = 10
"""Numbers in its longest observation."""

DEFAULTS: dict[str, dict[str, Any]] = {
    "ppo": {},
    "sac": {
        "timesteps": 300_000,
        "num_envs": 16,
        "batch_size": 256,
        "learning_rate": 1e-3,
        "final_learning_rate": 3e-4,
        "discount": 0.98,
        "checkpoint_interval": 25_000,
    },
}
"""Where an algorithm's defaults differ from the fields' own."""


@dataclass(frozen=True)
class TrainConfig(Configuration):
    """How a policy is trained. The defaults learn to walk the slippery floor with PPO.

    Names, meanings and units of the fields are those of `stickslip train biped --help`, which is
    made from them; those of one algorithm stand in a group, `config.ppo.epochs`, and `of` takes all
    of them by their names. Bad values raise ValueError naming the field, what was given and what is
    accepted.
    """

    algorithm: str = entry("ppo", str, "learning algorithm", choices=ALGORITHMS)
    seed: int = entry(0, int, "of everything random", low=0, high=2**31 - 1)
    timesteps: int = entry(6_000_000, int, "control steps in all", low=1, high=MOST_STEPS)

    scene: str = entry(SCENE, str, f"floor: {', '.join(SCENES)}")
    mu_static: float | None = entry(None, float, "one floor instead", low=0, optional=True)
    mu_kinetic: float | None = entry(
        None, float, "its kinetic friction, by default mu_static", low=0, optional=True
    )
    payload: float | None = entry(None, float, "on the hip [kg]", low=0, optional=True)
    commanded_rate: float = entry(3.0, float, "mean crank rate [rad/s]", low=0, strict=True)
    see_friction: bool = entry(False, bool, "the policy observes the friction underfoot")
    see_patch: bool = entry(False, bool, "the policy observes the next patch of floor")

    random_friction: tuple[float, float] | None = entry(
        None, "range", "factor on every friction, drawn at each start", low=0, optional=True
    )
    random_mass: tuple[float, float] | None = entry(
        None, "range", "factor on every mass, drawn at each start", low=1e-6, optional=True
    )
    random_payload: tuple[float, float] | None = entry(
        None, "range", "payload drawn at each start [kg]", low=0, optional=True
    )
    random_commanded_rate: tuple[float, float] | None = entry(
        None, "range", "commanded rate drawn at each start [rad/s]", low=1e-6, optional=True
    )
    start_rate: float = entry(
        5.0, float, "training starts at any phase and up to this crank rate [rad/s]", low=0, high=20
    )
    episode_time: float = entry(1.5, float, "length of training episodes [s]", low=0.02)
    slip_weight: float = entry(3.0, float, "of slip in the training reward", low=0)
    energy_weight: float = entry(0.5, float, "of energy in the training reward", low=0)
    fall_penalty: float = entry(1.0, float, "of a fall in the training reward", low=0)

    num_envs: int = entry(256, int, "environments side by side", low=1, high=65536)
    learning_rate: float = entry(1e-3, float, "at the beginning", low=0, strict=True)
    final_learning_rate: float = entry(1e-4, float, "at the end", low=0)
    discount: float = entry(0.99, float, "gamma, per control step", low=0, high=1)
    batch_size: int = entry(4096, int, "samples a gradient step", low=2)
    hidden: int = entry(64, int, "units a hidden layer", low=1, high=4096)
    layers: int = entry(2, int, "hidden layers", low=1, high=8)
    threads: int = entry(1, int, "of PyTorch", low=1, high=256)

    ppo: PPOSettings = group(PPOSettings)
    sac: SACSettings = group(SACSettings)

    checkpoint_interval: int = entry(
        262_144, int, "steps to the next checkpoint", low=1, high=MOST_STEPS
    )
    keep_checkpoints: int = entry(2, int, "of the latest, beside the best", low=1)
    evaluation_episodes: int = entry(64, int, "episodes an evaluation", low=1, high=65536)

    GROUPS: ClassVar = {
        "algorithm": "run",
        "scene": "task",
        "random_friction": "training episodes and their reward",
        "num_envs": "learning",
        "rollout_steps": "PPO",
        "buffer_size": "SAC",
        "checkpoint_interval": "checkpoints and evaluations",
    }
    EXCLUSIVE: ClassVar = {
        ("scene", "mu_static"): "floor",
        ("payload", "random_payload"): "payload",
        ("commanded_rate", "random_commanded_rate"): "rate",
    }

    @classmethod
    def _defaults(cls, algorithm: str) -> dict[str, Any]:
        return DEFAULTS.get(algorithm, {})

    def _check_together(self) -> None:
        require_room(self, BIPED_OBSERVATION)
        if self.algorithm == "ppo":
            require_whole_batches(self)
        self._require_inside("commanded_rate", "random_commanded_rate")
        if self.mu_static is not None and self.scene != SCENE:
            raise ValueError(
                f"scene = {self.scene!r} with mu_static = {self.mu_static}: both say which floor; "
                "accepted: one of them"
            )
        if self.payload is not None and self.random_payload is not None:
            raise ValueError("payload with random_payload; accepted: one of them")
        if self.mu_kinetic is not None and self.mu_static is None:
            raise ValueError(
                f"mu_kinetic = {self.mu_kinetic} without mu_static; accepted: both, mu_static "
                "alone or neither"
            )


def require_room(config: Any, observation: int) -> None:
    """Raise ValueError for networks that no policy file holds, and for samples that no memory does.

    observation: about how many numbers an observation has.
    """
    from stickslip.agents.foreign.arrays import LARGEST

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
        steps = config.ppo.rollout_steps
        given = f"num_envs = {config.num_envs} with rollout_steps = {steps}"
        samples = config.num_envs * steps
    require_memory(given, "samples", samples, 8 * (observation + 8))


def add_flags(parser: argparse.ArgumentParser, kind: type[Configuration] = TrainConfig) -> None:
    """One flag for each field; only those given appear in the parsed arguments."""
    config_fields.add_flags(parser, kind)


def from_flags(given: Mapping[str, Any], kind: type[Configuration] = TrainConfig) -> Any:
    """The configuration that parsed arguments ask for."""
    return kind.of(**flags_given(given, kind))


def flags_given(
    given: Mapping[str, Any], kind: type[Configuration] = TrainConfig
) -> dict[str, Any]:
    """Those of the parsed arguments that are fields of the configuration."""
    return config_fields.flags_given(given, kind)


__all__ = [
    "ALGORITHMS",
    "DEFAULTS",
    "PPOSettings",
    "SACSettings",
    "TrainConfig",
    "add_flags",
    "every_field",
    "flags_given",
    "from_flags",
    "require_whole_batches",
    "rule_of",
]
