"""What configurations of training runs share: checked fields, JSON, digests."""

from __future__ import annotations

import hashlib
import itertools
import json
from dataclasses import Field as DataclassField
from dataclasses import asdict, field, fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple, Self, TypeVar, Unpack

from stickslip.agents.untrusted import RefusedError, Rule, parse_json, require_entries, require_head
from stickslip.dynamics.plain_checks import require_choice, require_kind, require_known, shown

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Mapping
    from pathlib import Path

    from stickslip.agents.untrusted import Json, Kind, Limits


T = TypeVar("T")
S = TypeVar("S", bound="Settings")
Config = TypeVar("Config", bound="Configuration")
Config_co = TypeVar("Config_co", bound="Configuration", covariant=True)
FORMAT, VERSION = "stickslip training", 2
FLAT = 1
"""The version without groups: each field stands by its name. It is still read."""
UNNAMED = "biped"
"""The machine of a configuration that names none."""
BEFORE: dict[str, Json] = {"trainer": "sb3", "task": None, "tracking_weight": 1.0}
"""Fields that came later, and what runs were until then: a text without one means that, and one
that means it is without. So earlier files are read, and earlier digests stay as they were."""


def entry(default: T, kind: Kind, about: str, **rule: Unpack[Limits]) -> T:
    """A field of a configuration."""
    return field(default=default, metadata={"rule": Rule(kind, about, **rule)})


def group(kind: type[S], **defaults: Any) -> S:
    """A field of a configuration that holds several, whose names are unlike all others.

    defaults: where they differ from the fields' own. Nothing is built before a configuration is.
    """
    about = {"group": kind, "defaults": defaults}
    return field(default_factory=partial(kind, **defaults), metadata=about)


def later_group(kind: type[S]) -> S:
    """A group of the algorithm of its name that came later: it is written with this algorithm only,
    so that files and digests of all others stay as they were."""
    return field(default_factory=kind, metadata={"group": kind, "defaults": {}, "later": True})


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
        """As JSON text that `from_json` reads."""
        return self._json(VERSION, self._written())

    def _written(self) -> dict[str, Json]:
        content = asdict(self)  # pyright: ignore[reportArgumentType], their subclasses are dataclasses
        left = set(_unused(type(self), self.algorithm))
        left |= set() if self.task is None else {*self.FIXED, *self._own()}
        return {name: value for name, value in content.items() if name not in left}

    def _own(self) -> list[str]:
        """Fields of training episodes that are the named task's own."""
        return [name for name in self.USUALLY if getattr(self, name) is None]

    def _json(self, version: int, content: dict[str, Any]) -> str:
        head: dict[str, Json] = {"format": FORMAT, "version": version}
        head |= {} if self.machine == UNNAMED else {"machine": self.machine}
        before = BEFORE if self.task is None else _without(BEFORE, self.USUALLY)
        told = {name: one for name, one in content.items() if before.get(name, ...) != one}
        return json.dumps(head | told, indent=2) + "\n"

    @classmethod
    def from_json(cls, text: str) -> Self:
        """The configuration in a JSON text, or ValueError saying what is wrong with it."""
        content = content_of(text)
        if (machine := content.pop("machine", UNNAMED)) != cls.machine:
            raise RefusedError(f"it is of the {shown(machine)}, not of the {cls.machine}")
        rules = {one.name: rule_of(one) for one in every_field(cls)}
        entries = {name: BEFORE[name] for name in BEFORE if name in rules} | flat(content, cls)
        decided: set[str] = set()
        if entries.get("task") is not None:
            entries = _without(BEFORE, cls.USUALLY, of=rules) | flat(content, cls)
            decided = {*cls.FIXED, *cls.USUALLY}
        unused = _unused(cls, entries.get("algorithm"))
        entries |= {
            one.name: one.default
            for one in every_field(cls)
            if one.group in unused and one.name not in entries
        }
        rules = {name: rules[name] for name in rules if name in entries or name not in decided}
        return cls._grouped(require_entries(entries, rules))

    @property
    def digest(self) -> str:
        """A name for exactly this configuration; the same as before there were groups."""
        content = flat(self._written(), type(self))
        return hashlib.sha256(self._json(FLAT, content).encode()).hexdigest()[:16]


def content_of(text: str) -> dict[str, Json]:
    """The entries of a configuration's JSON text, without its head. ValueError if it is none."""
    content = parse_json(text, "it")
    earlier = isinstance(content, dict) and content.get("version") == FLAT
    version = FLAT if earlier else VERSION
    return require_head(content, FORMAT, version, "the configuration of a training run")


def _without(
    entries: Mapping[str, Json], names: Container[str], of: Container[str] | None = None
) -> dict[str, Json]:
    """The entries but for those names; of: and of these alone."""
    return {
        name: one
        for name, one in entries.items()
        if name not in names and (of is None or name in of)
    }


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


def _unused(kind: type[Configuration], algorithm: object) -> list[str]:
    """The groups that came later and are another algorithm's."""
    later = (one.name for one in _fields(kind) if one.metadata.get("later"))
    return [name for name in later if name != algorithm]


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
