"""The configuration of a training run: every number of it, checked, as a flag and as JSON."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict, dataclass, field, fields
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import argparse
    from collections.abc import Mapping

FORMAT, VERSION = "stickslip training", 1
ALGORITHMS = ("ppo", "sac")


@dataclass(frozen=True)
class Rule:
    """What a field accepts. kind: int, float, bool, str or "range" (two numbers, low <= high)."""

    kind: Any
    about: str
    low: float = -math.inf
    high: float = math.inf
    strict: bool = False
    """The lowest and highest value are themselves excluded."""
    optional: bool = False
    choices: tuple[str, ...] = ()

    @property
    def accepted(self) -> str:
        """In words."""
        if self.choices:
            return ", ".join(self.choices)
        if self.kind is bool or self.kind is str:
            return "true or false" if self.kind is bool else "a name"
        words = "an integer" if self.kind is int else "finite"
        less, more = ("<", ">") if self.strict else ("<=", ">=")
        words += "" if self.low == -math.inf else f", {more} {self.low:g}"
        words += "" if self.high == math.inf else f", {less} {self.high:g}"
        words = f"two numbers low <= high, {words}" if self.kind == "range" else words
        return f"{words}, or nothing" if self.optional else words

    def allows(self, value: Any) -> bool:
        """Whether a field may have this value."""
        if value is None:
            return self.optional
        if self.kind in (bool, str):
            return isinstance(value, self.kind) and (not self.choices or value in self.choices)
        if self.kind == "range":
            pair = isinstance(value, tuple) and len(value) == 2
            return pair and all(map(self._is_inside, value)) and value[0] <= value[1]
        whole = self.kind is not int or isinstance(value, int)
        return whole and self._is_inside(value)

    def _is_inside(self, value: Any) -> bool:
        if isinstance(value, bool) or not isinstance(value, int | float):
            return False
        if self.strict:
            return self.low < value < self.high
        return self.low <= value <= self.high and math.isfinite(value)


def _entry(default: Any, kind: Any, about: str, **rule: Any) -> Any:
    return field(default=default, metadata={"rule": Rule(kind, about, **rule)})


@dataclass(frozen=True)
class TrainConfig:
    """How a policy is trained. The defaults learn to walk the slippery floor with PPO.

    Names, meanings and units of the fields are those of `stickslip train biped --help`, which is
    made from them. Fields of one algorithm are ignored by the other. Bad values raise ValueError
    naming the field, what was given and what is accepted.
    """

    algorithm: str = _entry("ppo", str, "learning algorithm", choices=ALGORITHMS)
    seed: int = _entry(0, int, "of everything random", low=0, high=2**31 - 1)
    timesteps: int = _entry(6_000_000, int, "control steps in all", low=1)

    scene: str = _entry("slippery", str, "floor, by name")
    mu_static: float | None = _entry(None, float, "one floor instead", low=0, optional=True)
    mu_kinetic: float | None = _entry(
        None, float, "its kinetic friction, by default mu_static", low=0, optional=True
    )
    payload: float | None = _entry(None, float, "on the hip [kg]", low=0, optional=True)
    commanded_rate: float = _entry(3.0, float, "mean crank rate [rad/s]", low=0, strict=True)
    see_friction: bool = _entry(False, bool, "the policy observes the friction underfoot")
    see_patch: bool = _entry(False, bool, "the policy observes the next patch of floor")

    random_friction: tuple[float, float] | None = _entry(
        None, "range", "factor on every friction, drawn at each start", low=0, optional=True
    )
    random_mass: tuple[float, float] | None = _entry(
        None, "range", "factor on every mass, drawn at each start", low=1e-6, optional=True
    )
    random_payload: tuple[float, float] | None = _entry(
        None, "range", "payload drawn at each start [kg]", low=0, optional=True
    )
    random_commanded_rate: tuple[float, float] | None = _entry(
        None, "range", "commanded rate drawn at each start [rad/s]", low=1e-6, optional=True
    )
    start_rate: float = _entry(
        5.0, float, "training starts at any phase and up to this crank rate [rad/s]", low=0, high=20
    )
    episode_time: float = _entry(1.5, float, "length of training episodes [s]", low=0.02)
    slip_weight: float = _entry(3.0, float, "of slip in the training reward", low=0)
    energy_weight: float = _entry(0.5, float, "of energy in the training reward", low=0)
    fall_penalty: float = _entry(1.0, float, "of a fall in the training reward", low=0)

    num_envs: int = _entry(256, int, "environments side by side", low=1, high=65536)
    learning_rate: float = _entry(1e-3, float, "at the beginning", low=0, strict=True)
    final_learning_rate: float = _entry(1e-4, float, "at the end", low=0)
    discount: float = _entry(0.99, float, "gamma, per control step", low=0, high=1)
    batch_size: int = _entry(4096, int, "samples a gradient step", low=2)
    hidden: int = _entry(64, int, "units a hidden layer", low=1, high=4096)
    layers: int = _entry(2, int, "hidden layers", low=1, high=8)
    threads: int = _entry(1, int, "of PyTorch", low=1, high=256)

    rollout_steps: int = _entry(128, int, "ppo: steps of each environment an update", low=2)
    epochs: int = _entry(6, int, "ppo: passes over a rollout", low=1)
    gae_lambda: float = _entry(0.95, float, "ppo: of the advantage estimate", low=0, high=1)
    clip_range: float = _entry(0.2, float, "ppo: of the probability ratio", low=0, strict=True)
    noise: float = _entry(
        0.22, float, "ppo: standard deviation of exploration, in torque limits", low=0, strict=True
    )
    final_noise: float = _entry(0.03, float, "ppo: the same at the end", low=0, strict=True)

    buffer_size: int = _entry(300_000, int, "sac: transitions remembered", low=1)
    learning_starts: int = _entry(10_000, int, "sac: random steps beforehand", low=0)
    gradient_steps: int = _entry(8, int, "sac: gradient steps a step of all", low=1)
    soft_update: float = _entry(0.005, float, "sac: tau of the target network", low=0, high=1)

    checkpoint_interval: int = _entry(262_144, int, "steps to the next checkpoint", low=1)
    keep_checkpoints: int = _entry(2, int, "of the latest, beside the best", low=1)
    evaluation_episodes: int = _entry(64, int, "episodes an evaluation", low=1, high=65536)

    def __post_init__(self):
        for one in fields(self):
            value, rule = getattr(self, one.name), rule_of(one)
            if isinstance(value, list):
                object.__setattr__(self, one.name, value := tuple(value))
            if not rule.allows(value):
                raise ValueError(
                    f"{one.name} = {value!r} is not accepted; accepted: {rule.accepted}"
                )
        self._check_together()

    def _check_together(self) -> None:
        rollout = self.num_envs * self.rollout_steps
        if self.algorithm == "ppo" and (self.batch_size > rollout or rollout % self.batch_size):
            raise ValueError(
                f"batch_size = {self.batch_size} is not accepted; accepted: a divisor of "
                f"num_envs x rollout_steps = {rollout}"
            )
        if self.mu_kinetic is not None and self.mu_static is None:
            raise ValueError(
                f"mu_kinetic = {self.mu_kinetic} without mu_static; accepted: both, mu_static "
                "alone or neither"
            )

    @classmethod
    def of(cls, **given: Any) -> TrainConfig:
        """The algorithm's defaults with some fields changed. ValueError for an unknown field."""
        known = [one.name for one in fields(cls)]
        for name in given:
            if name not in known:
                raise ValueError(f"{name!r} is no field; accepted: {', '.join(known)}")
        return cls(**(DEFAULTS.get(given.get("algorithm", "ppo"), {}) | given))

    def to_json(self) -> str:
        """As JSON text that `from_json` reads."""
        return json.dumps({"format": FORMAT, "version": VERSION} | asdict(self), indent=2) + "\n"

    @classmethod
    def from_json(cls, text: str) -> TrainConfig:
        """The configuration in a JSON text, or ValueError saying what is wrong with it."""
        try:
            content = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise ValueError(f"it is no JSON ({error})") from error
        if not isinstance(content, dict) or content.pop("format", None) != FORMAT:
            raise ValueError("it does not say that it is the configuration of a training run")
        if (version := content.pop("version", None)) != VERSION:
            raise ValueError(f"its version is {version!r}, this is version {VERSION}")
        missing = [one.name for one in fields(cls) if one.name not in content]
        if missing:
            raise ValueError(f"it lacks {', '.join(missing)}")
        return cls.of(**content)

    @property
    def digest(self) -> str:
        """A name for exactly this configuration."""
        return hashlib.sha256(self.to_json().encode()).hexdigest()[:16]


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


def rule_of(one: Any) -> Rule:
    """What a field accepts."""
    return one.metadata["rule"]


def add_flags(parser: argparse.ArgumentParser) -> None:
    """One flag for each field; only those given appear in the parsed arguments."""
    import argparse

    for one in fields(TrainConfig):
        rule = rule_of(one)
        options: dict[str, Any] = {"default": argparse.SUPPRESS, "dest": one.name}
        shown = "none" if one.default is None else one.default
        options["help"] = f"{rule.about} (default: {shown})".replace("%", "%%")
        if rule.kind is bool:
            options["action"] = argparse.BooleanOptionalAction
        elif rule.kind == "range":
            options |= {"nargs": 2, "type": float, "metavar": ("LOW", "HIGH")}
        else:
            options |= {"type": rule.kind, "metavar": rule.kind.__name__.upper()}
        parser.add_argument("--" + one.name.replace("_", "-"), **options)


def from_flags(given: Mapping[str, Any]) -> TrainConfig:
    """The configuration that parsed arguments ask for."""
    return TrainConfig.of(**flags_given(given))


def flags_given(given: Mapping[str, Any]) -> dict[str, Any]:
    """Those of the parsed arguments that are fields of the configuration."""
    return {one.name: given[one.name] for one in fields(TrainConfig) if one.name in given}
