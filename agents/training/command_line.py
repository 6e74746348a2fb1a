"""The command that trains with a configuration."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING

from stickslip.agents.training.configuration import every_field

if TYPE_CHECKING:
    from stickslip.agents.training.configuration import Configuration


def command_of(config: Configuration, out: str | None = None) -> str:
    """`stickslip train ...` with every flag that is not its default; out: the run's directory."""
    kind = type(config)
    chosen = {name: getattr(config, name) for name in ("task", "algorithm", "trainer")}
    usual = kind.of(**{name: one for name, one in chosen.items() if one is not None})
    trainer = kind.of(algorithm=config.algorithm)  # an algorithm has a usual one
    first = {"algorithm": kind.algorithm, "trainer": _value(trainer, "trainer", None)}
    words = ["stickslip", "train"]
    words += [kind.machine] if config.task is None else ["--task", config.task]
    for one in every_field(kind):
        value = _value(config, one.name, one.group)
        default = first.get(one.name, _value(usual, one.name, one.group))
        if one.name != "task" and value != default:
            words += _flag("--" + one.name.replace("_", "-"), value)
    words += [] if out is None else ["--out", out]
    return shlex.join(words)


def _value(config: Configuration, name: str, group: str | None) -> object:
    return getattr(config if group is None else getattr(config, group), name)


def _flag(flag: str, value: object) -> list[str]:
    if isinstance(value, bool):
        return [flag if value else "--no-" + flag.removeprefix("--")]
    values = value if isinstance(value, tuple | list) else (value,)
    return [flag, *map(_short, values)]


def _short(value: object) -> str:
    """A whole number without its point."""
    return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)
