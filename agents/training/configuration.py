"""Configurations of training runs: checked fields, JSON and TOML files, command lines."""

from __future__ import annotations

import hashlib
import itertools
import json
import shlex
import tomllib
from dataclasses import Field as DataclassField
from dataclasses import asdict, field, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple, Self, TypeVar, Unpack

from stickslip.agents.untrusted import (
    RefusedError,
    Rule,
    parse_json,
    read_text,
    refusing,
    require_head,
)
from stickslip.dynamics.plain_checks import require_choice, require_kind, require_known, shown

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from stickslip.agents.untrusted import Json, Kind, Limits


T = TypeVar("T")
S = TypeVar("S", bound="Settings")
Config = TypeVar("Config", bound="Configuration")
Config_co = TypeVar("Config_co", bound="Configuration", covariant=True)
FORMAT, VERSION = "stickslip training", 2
UNNAMED = "biped"
"""The machine of a file that names none."""
UNNAMED_TRAINER = "sb3"
"""The trainer of a file that names none."""


def entry(default: T, kind: Kind, about: str, **rule: Unpack[Limits]) -> T:
    """A field of a configuration."""
    return field(default=default, metadata={"rule": Rule(kind, about, **rule)})


def group(kind: type[S], **defaults: Any) -> S:
    """A field of a configuration that holds several, whose names are unlike all others.

    defaults: where they differ from the fields' own. Nothing is built before a configuration is.
    """
    about = {"group": kind, "defaults": defaults}
    return field(default_factory=partial(kind, **defaults), metadata=about)


class Field(NamedTuple):
    """A field of a configuration, in whichever group; like those of `dataclasses.fields`."""

    name: str
    default: Any
    metadata: Mapping[str, Any]
    group: str | None = None


def every_field(kind: type[Configuration]) -> list[Field]:
    """All fields of a configuration, those in its groups among them.

    What the rule of one in a group is about begins with the group's name.
    """
    found: list[Field] = []
    for one in _fields(kind):
        if "group" not in one.metadata:
            found.append(Field(one.name, one.default, one.metadata))
            continue
        for inner in fields(one.metadata["group"]):
            rule = replace(rule_of(inner), about=f"{one.name}: {rule_of(inner).about}")
            default = one.metadata["defaults"].get(inner.name, inner.default)
            found.append(Field(inner.name, default, {"rule": rule}, one.name))
    return found


def rule_of(one: Field | DataclassField[Any]) -> Rule:
    """Rule of a field's accepted values."""
    return one.metadata["rule"]


class Settings:
    """The base of frozen dataclasses made of `entry` fields; it has no field of its own."""

    def __post_init__(self):
        for one in _fields(self):
            value = getattr(self, one.name)
            if "group" in one.metadata:
                kind = one.metadata["group"]
                require_kind(one.name, value, kind, f"a {kind.__name__}")
            else:
                object.__setattr__(self, one.name, rule_of(one).require(one.name, value))


class Configuration(Settings):
    """A configuration of training runs: settings, some of them in groups.

    machine: what is trained. What every run needs is named here; a machine's dataclass gives each
    of these its default (see `shared` in groups.py) and adds its own.
    """

    algorithm: str
    seed: int
    timesteps: int
    checkpoint_interval: int
    keep_checkpoints: int
    evaluation_episodes: int
    task: str | None = None
    """A named task to train on; a field where the machine has such tasks."""

    machine: ClassVar[str] = UNNAMED
    FIXED: ClassVar[tuple[str, ...]] = ()
    """Fields that a named task decides, and that are not written beside one."""
    USUALLY: ClassVar[Mapping[str, Json]] = {}
    """Fields of training episodes alone -> what None stands for without a named task. Beside one
    None is the task's own, and is not written."""
    FLAGS: ClassVar[tuple[str, ...]] = ()
    """Fields that have a flag in `stickslip train`; all others are given by `--set`."""
    EXCLUSIVE: ClassVar[dict[tuple[str, str], str]] = {}
    """Pairs of fields of which at most one is given, and what both of them decide."""

    def __post_init__(self):
        super().__post_init__()
        if self.task is None:
            for name, value in self.USUALLY.items():
                if getattr(self, name) is None:
                    object.__setattr__(self, name, value)
        else:
            object.__setattr__(self, "task", own_task(self.task, self.machine))
            usual = {one.name: one.default for one in _fields(self)}
            changed = [name for name in self.FIXED if getattr(self, name) != usual[name]]
            refuse_fixed(changed, self.task)
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
    def of(cls, /, **given: Any) -> Self:
        """The algorithm's defaults with some fields changed, those in groups by their own names.

        ValueError for an unknown field, for two fields that both say the same thing, and for one of
        the other algorithm.
        """
        rules = {one.name: rule_of(one) for one in every_field(cls)}
        require_known(given, rules)
        given = {name: value for name, value in given.items() if value is not None}
        for kind in sorted(given.keys() & rules.keys() & {"algorithm", "trainer"}):
            require_choice(kind, given[kind], rules[kind].choices)
        if given.get("task") is not None:
            refuse_fixed([name for name in cls.FIXED if name in given], str(given["task"]))
        defaults = cls._defaults(str(given.get("algorithm", "ppo")), given.get("trainer"))
        known = {one.name: one.default for one in every_field(cls)} | defaults | given
        for one, other in cls.EXCLUSIVE:
            if one in given and other in given:
                raise ValueError(
                    f"{one} with {other}: both say which {cls.EXCLUSIVE[one, other]}; accepted: "
                    "one of them"
                )
        for name, kind in itertools.product(given, ("algorithm", "trainer")):
            whose = rules[name].about.partition(": ")[0]
            if kind in rules and whose in rules[kind].choices and whose != known[kind]:
                raise ValueError(
                    f"{name} with {kind} = {shown(known[kind])}, which has none; accepted: with "
                    f"{kind} = {whose!r}"
                )
        return cls._grouped(defaults | given)

    @classmethod
    def _defaults(cls, algorithm: str, trainer: str | None = None) -> dict[str, Json]:
        """Defaults of an algorithm and a trainer that differ from the fields' own.

        trainer: None where none is asked for, the algorithm's usual one is meant then.
        """
        return {}

    @classmethod
    def _grouped(cls, given: Mapping[str, Any]) -> Self:
        """From values by the fields' names, whichever groups they are in."""
        left, groups = dict(given), {}
        for one in _fields(cls):
            if "group" in one.metadata:
                kind, values = one.metadata["group"], dict(one.metadata["defaults"])
                inner = [each.name for each in fields(kind) if each.name in left]
                groups[one.name] = kind(**values | {name: left.pop(name) for name in inner})
        return cls(**left, **groups)

    def to_json(self) -> str:
        """As JSON text that `from_json` reads; what the named task decides is left out."""
        content = asdict(self)  # pyright: ignore[reportArgumentType], their subclasses are dataclasses
        if self.task is not None:
            own = [name for name in self.USUALLY if getattr(self, name) is None]
            content = {name: content[name] for name in content if name not in {*self.FIXED, *own}}
        head = {"format": FORMAT, "version": VERSION, "machine": self.machine}
        return json.dumps(head | content, indent=2) + "\n"

    @classmethod
    def from_json(cls, text: str) -> Self:
        """The configuration in a JSON text; fields that are missing have the algorithm's defaults.

        ValueError saying what is wrong with it.
        """
        content = content_of(text)
        require_machine(content.pop("machine", UNNAMED), cls)
        entries, rules = flat(content, cls), {one.name: rule_of(one) for one in every_field(cls)}
        require_known(entries, rules)
        if "trainer" in rules:
            entries.setdefault("trainer", UNNAMED_TRAINER)
        for kind in sorted(entries.keys() & {"algorithm", "trainer"}):
            require_choice(kind, entries[kind], rules[kind].choices)
        trainer = entries.get("trainer")
        trainer = trainer if isinstance(trainer, str) else None
        usual = cls._defaults(str(entries.get("algorithm", "ppo")), trainer)
        return cls._grouped(usual | entries)

    @property
    def digest(self) -> str:
        """A name for exactly this configuration."""
        return hashlib.sha256(self.to_json().encode()).hexdigest()[:16]


def content_of(text: str) -> dict[str, Json]:
    """The entries of a configuration's JSON text, without its head. ValueError if it is none."""
    return require_head(
        parse_json(text, "it"), FORMAT, VERSION, "the configuration of a training run"
    )


def require_machine(name: object, kind: type[Configuration]) -> None:
    """Raise ValueError for the name of another machine."""
    if name != kind.machine:
        raise RefusedError(f"it is of the {shown(name)}, not of the {kind.machine}")


def flat(content: Mapping[str, Json], kind: type[Configuration]) -> dict[str, Json]:
    """The entries of groups in the place of the groups. ValueError for what is no group of these,
    and for an entry that stands in and beside one."""
    names = {one.name: one.metadata["group"] for one in _fields(kind) if "group" in one.metadata}
    found: dict[str, Json] = {}
    for name, value in content.items():
        entries = {name: value}
        if name in names:
            if not isinstance(value, dict):
                raise RefusedError(f"{name} = {shown(value)} is no group of settings")
            entries = value
            require_known(entries, [one.name for one in fields(names[name])], f"field of {name}")
        if twice := [each for each in entries if each in found]:
            raise RefusedError(f"it has {', '.join(twice)} twice")
        found |= entries
    return found


def _fields(kind: Settings | type[Settings]) -> tuple[DataclassField[Any], ...]:
    return fields(kind)  # pyright: ignore[reportArgumentType], their subclasses are dataclasses


def own_task(name: str, machine: str) -> str:
    """The task's plain name. ValueError for an unknown task, and for one of another machine."""
    from stickslip.envs.tasks.definition import TASKS, task_by_name

    task = task_by_name(name)
    if task.machine != machine:
        own = [one.name for one in TASKS.values() if one.machine == machine]
        raise ValueError(
            f"task = {task.name!r} is of the {task.machine}, this configuration of the "
            f"{machine}; accepted: {', '.join(own) or 'none'}"
        )
    return task.name


def refuse_fixed(given: Iterable[str], task: str) -> None:
    """ValueError for fields that a task decides, if there are any."""
    if found := list(given):
        raise ValueError(
            f"{', '.join(found)} with task = {shown(task)}, whose definition says "
            f"{'it' if len(found) == 1 else 'them'} and never changes; accepted: one or the other"
        )


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


def read_settings(path: str | Path, kind: type[Configuration]) -> Mapping[str, object]:
    """Fields by name in a TOML file, or those of a run's config.json that are no defaults.

    ValueError, naming the file, for anything else and for another machine's.
    """
    try:
        text = read_text(path)
        if Path(path).suffix.lower() == ".json":
            return changes(kind.from_json(text))
        with refusing("it"):
            content = tomllib.loads(text)
        require_machine(content.pop("machine", kind.machine), kind)
        found = flat(content, kind)
        require_known(found, [one.name for one in every_field(kind)])
    except ValueError as error:
        raise ValueError(
            f"{path}: {error}; accepted: a TOML file of settings, or a run's config.json"
        ) from error
    return found


def _value(config: Configuration, name: str, group: str | None) -> object:
    return getattr(config if group is None else getattr(config, group), name)


def _text(value: object) -> str:
    """A value as the command line takes it; a whole number without its point."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return ",".join(map(_text, value))
    return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)


class Trained(NamedTuple, Generic[Config_co]):
    """Result of a call of `train`."""

    directory: Path
    policy: Path
    """The policy of the best evaluation."""
    config: Config_co
    """The machine's configuration."""
    timesteps: int
    seconds: float
    """Trained in all, over every resumption [s]."""
    finished: bool

    @property
    def percent(self) -> int:
        """Percentage of the training that is done, 100 at its end only."""
        return min(100 * self.timesteps // self.config.timesteps, 100)

    @property
    def name(self) -> str:
        """Name of the policy, which says if it is not trained to the end."""
        if self.finished:
            return "trained policy"
        return f"policy after {self.percent} % of its training"
