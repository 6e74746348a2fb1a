"""Configurations and command lines: what a command asks for, and which command asks for it."""

from __future__ import annotations

import shlex
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.agents.registry import read_configuration
from stickslip.agents.training.configuration import every_field, flat
from stickslip.agents.untrusted import RefusedError, read_text, refusing
from stickslip.dynamics.plain_checks import require_known, shown

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.agents.training.configuration import Config, Configuration


def command_of(config: Configuration, out: str | None = None) -> str:
    """`stickslip train ...` with all that is not a default; out: the run's directory."""
    words = ["stickslip", "train"]
    words += [config.machine] if config.task is None else ["--task", config.task]
    settings = []
    for name, value in changes(config).items():
        if name not in config.FLAGS:
            settings.append(f"{name}={_text(value)}")
        elif name != "task":
            words += ["--" + name.replace("_", "-"), _text(value)]
    words += [] if out is None else ["--out", out]
    words += ["--set", *settings] if settings else []
    return shlex.join(words)


def changes(config: Configuration) -> dict[str, object]:
    """Fields by name that differ from their defaults; `of` makes the configuration of them."""
    kind = type(config)
    chosen = {name: getattr(config, name) for name in ("task", "algorithm", "trainer")}
    usual = kind.of(**{name: one for name, one in chosen.items() if one is not None})
    trainer = _value(kind.of(algorithm=config.algorithm), "trainer", None)
    defaults = {"algorithm": kind.algorithm, "trainer": trainer, "task": None}
    values = {one.name: _value(config, one.name, one.group) for one in every_field(kind)}
    for one in every_field(kind):
        default = defaults.get(one.name, _value(usual, one.name, one.group))
        if values[one.name] == default:
            del values[one.name]
    return values


def settings_given(given: Mapping[str, Any], kind: type[Configuration]) -> dict[str, object]:
    """Fields by name as parsed arguments give them: those of --config FILE, and before them those
    of the command line."""
    found = {} if given.get("config") is None else read_settings(given["config"], kind)
    own = {one.name: given[one.name] for one in every_field(kind) if one.name in given}
    return {**found, **own}


def from_flags(given: Mapping[str, Any], kind: type[Config]) -> Config:
    """The configuration that parsed arguments ask for."""
    return kind.of(**settings_given(given, kind))


def read_settings(path: str | Path, kind: type[Configuration]) -> Mapping[str, object]:
    """Fields by name in a TOML file, or those of a run's config.json that are no defaults.

    ValueError, naming the file, for anything else and for another machine's.
    """
    try:
        text = read_text(path)
        if Path(path).suffix.lower() == ".json":
            config = read_configuration(text)
            _require_machine(config.machine, kind)
            return changes(config)
        with refusing("it"):
            content = tomllib.loads(text)
        _require_machine(content.pop("machine", kind.machine), kind)
        found = flat(content, kind)
        require_known(found, [one.name for one in every_field(kind)])
    except ValueError as error:
        raise ValueError(
            f"{path}: {error}; accepted: a TOML file of settings, or a run's config.json"
        ) from error
    return found


def _require_machine(name: object, kind: type[Configuration]) -> None:
    if name != kind.machine:
        raise RefusedError(f"it is of the {shown(name)}, not of the {kind.machine}")


def _value(config: Configuration, name: str, group: str | None) -> object:
    return getattr(config if group is None else getattr(config, group), name)


def _text(value: object) -> str:
    """A value as the command line takes it; a whole number without its point."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return ",".join(map(_text, value))
    return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)
