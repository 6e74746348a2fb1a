"""What configurations of training runs share: checked fields, JSON, flags of the command line."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, field, fields
from typing import TYPE_CHECKING, Any, ClassVar

from stickslip.agents.foreign import RefusedError, parse_json, require_entries, require_head
from stickslip.agents.rules import Rule
from stickslip.dynamics.plain_checks import require_known, shown

if TYPE_CHECKING:
    import argparse
    from collections.abc import Mapping

FORMAT, VERSION = "stickslip training", 1
BIPED = "biped"
"""The machine of a configuration that names none."""


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
    GROUPS: ClassVar[dict[str, str]] = {}
    """First field of each group of flags -> the group's title."""
    EXCLUSIVE: ClassVar[dict[tuple[str, str], str]] = {}
    """Pairs of fields of which at most one is given, and what both of them decide."""

    def __post_init__(self):
        for one in _fields(self):
            value = rule_of(one).require(one.name, getattr(self, one.name))
            object.__setattr__(self, one.name, value)
        self._check_together()

    def _check_together(self) -> None:
        """Raise ValueError for fields that do not go together."""

    def _require_inside(self, name: str, drawn: str) -> None:
        """Raise ValueError for a number outside the range that is drawn in its place."""
        value, ends = getattr(self, name), getattr(self, drawn)
        if ends is not None and not ends[0] <= value <= ends[1]:
            raise ValueError(
                f"{name} = {value} outside {drawn} = {ends}, which is drawn in its place; "
                "accepted: a number inside"
            )

    @classmethod
    def of(cls, /, **given: Any):
        """The algorithm's defaults with some fields changed.

        ValueError for an unknown field, for two fields that both say the same thing, and for one of
        the other algorithm.
        """
        rules = {one.name: rule_of(one) for one in _fields(cls)}
        require_known(given, rules)
        given = {name: value for name, value in given.items() if value is not None}
        algorithm = given.get("algorithm", "ppo")
        for one, other in cls.EXCLUSIVE:
            if one in given and other in given:
                raise ValueError(
                    f"{one} with {other}: both say which {cls.EXCLUSIVE[one, other]}; accepted: "
                    "one of them"
                )
        for name in given:
            whose = rules[name].about.partition(": ")[0]
            if whose in rules["algorithm"].choices and whose != algorithm:
                raise ValueError(
                    f"{name} with algorithm = {shown(algorithm)}, which has none; accepted: with "
                    f"algorithm = {whose!r}"
                )
        return cls(**(cls._defaults(str(algorithm)) | given))

    @classmethod
    def _defaults(cls, algorithm: str) -> dict[str, Any]:
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
            raise RefusedError(f"it is of the {shown(machine)}, not of the {cls.machine}")
        rules = {one.name: rule_of(one) for one in _fields(cls)}
        return cls(**require_entries(content, rules))

    @property
    def digest(self) -> str:
        """A name for exactly this configuration."""
        return hashlib.sha256(self.to_json().encode()).hexdigest()[:16]


def content_of(text: str) -> dict[str, Any]:
    """The entries of a configuration's JSON text, without its head. ValueError if it is none."""
    content = parse_json(text, "it")
    return require_head(content, FORMAT, VERSION, "the configuration of a training run")


def add_flags(parser: argparse.ArgumentParser, kind: type[Configuration]) -> None:
    """One flag for each field, in groups; only those given appear in the parsed arguments."""
    import argparse

    group: Any = parser
    for one in _fields(kind):
        if one.name in kind.GROUPS:
            group = parser.add_argument_group(kind.GROUPS[one.name])
        rule = rule_of(one)
        options: dict[str, Any] = {"default": argparse.SUPPRESS, "dest": one.name}
        options["help"] = _help_of(one, kind).replace("%", "%%")
        if rule.kind is bool:
            options["action"] = argparse.BooleanOptionalAction
        elif rule.kind == "range":
            options |= {"nargs": 2, "type": float, "metavar": ("LOW", "HIGH")}
        else:
            options |= {"type": rule.kind, "metavar": rule.kind.__name__.upper()}
        group.add_argument("--" + one.name.replace("_", "-"), **options)


def _help_of(one: Any, kind: type[Configuration]) -> str:
    """What a field is, what it may be where that is a name, and its defaults."""
    rule = rule_of(one)
    choices = f": {', '.join(rule.choices)}" if rule.choices else ""
    defaults = "none" if one.default is None else f"{one.default}"
    for algorithm in next(rule_of(of).choices for of in _fields(kind) if of.name == "algorithm"):
        other = kind._defaults(algorithm).get(one.name, one.default)
        defaults += f"; {algorithm}: {other}" if other != one.default else ""
    return f"{rule.about}{choices} (default: {defaults})"


def flags_given(given: Mapping[str, Any], kind: type[Configuration]) -> dict[str, Any]:
    """Those of the parsed arguments that are fields of the configuration."""
    return {one.name: given[one.name] for one in _fields(kind) if one.name in given}


def _fields(kind: Any) -> Any:
    return fields(kind)
