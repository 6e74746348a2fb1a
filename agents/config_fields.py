"""What configurations of training runs share: checked fields, JSON, flags of the command line."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict, dataclass, field, fields
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    import argparse
    from collections.abc import Mapping

FORMAT, VERSION = "stickslip training", 1
BIPED = "biped"
"""The machine of a configuration that names none."""


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


def entry(default: Any, kind: Any, about: str, **rule: Any) -> Any:
    """A field of a configuration."""
    return field(default=default, metadata={"rule": Rule(kind, about, **rule)})


def rule_of(one: Any) -> Rule:
    """What a field accepts."""
    return one.metadata["rule"]


class Configuration:
    """The base of frozen dataclasses made of `entry` fields; it has no field of its own.

    machine: what is trained.
    """

    machine: ClassVar[str] = BIPED

    def __post_init__(self):
        for one in _fields(self):
            value, rule = getattr(self, one.name), rule_of(one)
            if isinstance(value, list):
                object.__setattr__(self, one.name, value := tuple(value))
            if not rule.allows(value):
                raise ValueError(
                    f"{one.name} = {value!r} is not accepted; accepted: {rule.accepted}"
                )
        self._check_together()

    def _check_together(self) -> None:
        """Raise ValueError for fields that do not go together."""

    @classmethod
    def of(cls, **given: Any):
        """The algorithm's defaults with some fields changed. ValueError for an unknown field."""
        known = [one.name for one in _fields(cls)]
        for name in given:
            if name not in known:
                raise ValueError(f"{name!r} is no field; accepted: {', '.join(known)}")
        return cls(**(cls._defaults(given.get("algorithm", "ppo")) | given))

    @classmethod
    def _defaults(cls, algorithm: Any) -> dict[str, Any]:
        """Where an algorithm's defaults differ from the fields' own."""
        return {}

    def to_json(self) -> str:
        """As JSON text that `from_json` reads."""
        head: dict[str, Any] = {"format": FORMAT, "version": VERSION}
        head |= {} if self.machine == BIPED else {"machine": self.machine}
        return json.dumps(head | asdict(self), indent=2) + "\n"  # pyright: ignore[reportArgumentType]

    @classmethod
    def from_json(cls, text: str):
        """The configuration in a JSON text, or ValueError saying what is wrong with it."""
        content = content_of(text)
        if (machine := content.pop("machine", BIPED)) != cls.machine:
            raise ValueError(f"it is of the {machine}, not of the {cls.machine}")
        missing = [one.name for one in _fields(cls) if one.name not in content]
        if missing:
            raise ValueError(f"it lacks {', '.join(missing)}")
        return cls.of(**content)

    @property
    def digest(self) -> str:
        """A name for exactly this configuration."""
        return hashlib.sha256(self.to_json().encode()).hexdigest()[:16]


def content_of(text: str) -> dict[str, Any]:
    """The entries of a configuration's JSON text, without its head. ValueError if it is none."""
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"it is no JSON ({error})") from error
    if not isinstance(content, dict) or content.pop("format", None) != FORMAT:
        raise ValueError("it does not say that it is the configuration of a training run")
    if (version := content.pop("version", None)) != VERSION:
        raise ValueError(f"its version is {version!r}, this is version {VERSION}")
    return content


def add_flags(parser: argparse.ArgumentParser, kind: type[Configuration]) -> None:
    """One flag for each field; only those given appear in the parsed arguments."""
    import argparse

    for one in _fields(kind):
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


def flags_given(given: Mapping[str, Any], kind: type[Configuration]) -> dict[str, Any]:
    """Those of the parsed arguments that are fields of the configuration."""
    return {one.name: given[one.name] for one in _fields(kind) if one.name in given}


def _fields(kind: Any) -> Any:
    return fields(kind)
