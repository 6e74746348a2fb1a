"""Configurations of training runs: checked fields, JSON and TOML files, command lines."""

import hashlib
import itertools
import json
import shlex
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, ClassVar, Generic, NamedTuple, Self, TypeVar

from stickslip.agents import untrusted
from stickslip.dynamics.checks import require_known, require_memory, require_that, reraise, shown
from stickslip.envs.tasks.definition import TASKS, task_by_name

T = TypeVar("T")
Config = TypeVar("Config", bound="Configuration")
Config_co = TypeVar("Config_co", bound="Configuration", covariant=True)
FORMAT, VERSION = "stickslip training", 2
MOST_STEPS = 10**12 - 1
"""Largest step count in the name of a checkpoint."""


def entry(default: T, kind: untrusted.Kind, about: str, **rule: Any) -> T:
    """A field of a configuration. Where the default is None, None is accepted."""
    found = untrusted.Rule(kind, about, optional=default is None, **rule)
    return field(default=default, metadata={"rule": found})


def positive(default: T, about: str) -> T:
    """A field with a number > 0."""
    return entry(default, float, about, low=0, strict=True)


def drawn(about: str, low: float = 0.0) -> tuple[float, float] | None:
    """A field with the ends of a range that a start draws from, by default none."""
    return entry(None, "range", f"{about}, drawn at each start", low=low)


@dataclass(frozen=True)
class Configuration:
    """A configuration of training runs.

    A machine's own is a frozen dataclass on top, which says `machine`, changes defaults by
    `shared(name, default)` and adds fields by `entry`. Bad values raise ValueError naming the
    field, the value and what is accepted.
    """

    trainer: str = entry("jax", str, "JAX or Stable-Baselines3", choices=("jax", "sb3"))
    seed: int = entry(0, int, "of everything random", low=0, high=2**31 - 1)
    timesteps: int = entry(1_000_000, int, "control steps in all", low=1, high=MOST_STEPS)

    num_envs: int = entry(64, int, "environments side by side", low=1, high=65536)
    learning_rate: float = positive(1e-3, "at the beginning")
    final_learning_rate: float = entry(1e-4, float, "at the end", low=0)
    discount: float = entry(0.99, float, "gamma, per control step", low=0, high=1)
    batch_size: int = entry(512, int, "samples a gradient step", low=2)
    hidden: int = entry(64, int, "units a hidden layer", low=1, high=4096)
    layers: int = entry(2, int, "hidden layers", low=1, high=8)
    history: int = entry(0, int, "steps before that the policy sees", low=0, high=64)

    rollout_steps: int = entry(128, int, "steps of each environment an update", low=2)
    epochs: int = entry(6, int, "passes over a rollout", low=1, high=10_000)
    gae_lambda: float = entry(0.95, float, "of the advantage estimate", low=0, high=1)
    clip_range: float = positive(0.2, "of the probability ratio")
    noise: float = positive(0.22, "standard deviation of exploration, the largest action being 1")
    final_noise: float = positive(0.03, "the same at the end")

    checkpoint_interval: int = entry(65_536, int, "steps of a stretch", low=1, high=MOST_STEPS)
    keep_checkpoints: int = entry(2, int, "of the latest, beside the best", low=1)
    evaluation_episodes: int = entry(32, int, "episodes an evaluation", low=1, high=65536)
    task: str | None = entry(None, str, "of `stickslip tasks`; it says all of what is trained on")

    machine: ClassVar[str] = "biped"
    OWN: ClassVar[str] = ""
    """The field with a machine of the user's, as the text of its file."""
    PARTS: ClassVar[tuple[str, ...]] = ()
    """Parts of that machine whose numbers `--set PART.NAME=VALUE` changes."""
    LEARNING: ClassVar[tuple[str, ...]] = ()
    """A machine's own fields that no named task decides."""
    USUALLY: ClassVar[Mapping[str, untrusted.Json]] = {}
    """Fields of training episodes alone -> what None stands for without a named task. Beside one
    None is the task's own, and is not written."""
    FLAGS: ClassVar[tuple[str, ...]] = ("task", "trainer", "seed", "timesteps")
    FLAGS += ("num_envs", "learning_rate")
    """Fields that have a flag in `stickslip train`; all others are given by `--set`."""

    def __post_init__(self):
        for one in fields(self):
            value = one.metadata["rule"].require(one.name, getattr(self, one.name))
            object.__setattr__(self, one.name, value)
        if self.task is None:
            for name, value in self.USUALLY.items():
                if getattr(self, name) is None:
                    object.__setattr__(self, name, value)
        else:
            object.__setattr__(self, "task", own_task(self.task, self.machine))
            usual = {one.name: one.default for one in fields(self)}
            changed = [name for name in self.fixed() if getattr(self, name) != usual[name]]
            refuse_fixed(changed, self.task)
        self._check_together()
        samples = self.num_envs * self.rollout_steps
        accepted = f"a divisor of num_envs x rollout_steps = {samples}"
        require_that(samples % self.batch_size == 0, "batch_size", self.batch_size, accepted)

    @classmethod
    def own_machine(cls, path: str | None, changes: Mapping[str, str]) -> dict[str, str]:
        """The field with the text of a user's machine: of a file, with single numbers changed."""
        raise ValueError(f"{', '.join(changes)}; accepted: settings of the {cls.machine}")

    def _check_together(self) -> None:
        """Raise ValueError for fields that do not go together."""

    def _require_inside(self, name: str, drawn: str) -> None:
        """Raise ValueError for a number outside the range that is drawn in its place."""
        value, ends = getattr(self, name), getattr(self, drawn)
        if ends is not None and not ends[0] <= value <= ends[1]:
            given = f"{name} = {value} outside {drawn} = {ends}, which is drawn in its place"
            raise ValueError(f"{given}; accepted: a number inside")

    def _require_room(self, observation: int) -> None:
        """Raise ValueError for networks that no policy file holds, and for samples that no memory
        does. observation: about how many numbers an observation has."""
        observation += self.history * (observation + 2)
        widths = [observation, *[self.hidden] * self.layers, 2]
        size = 4 * sum((one + 1) * other for one, other in itertools.pairwise(widths))
        if size > untrusted.LARGEST - 2 * untrusted.LARGEST_TEXT:
            raise ValueError(
                f"hidden = {self.hidden} with layers = {self.layers} makes a policy of {size:,} "
                f"bytes; accepted: what fits a policy file, {untrusted.LARGEST:,} bytes"
            )
        given = f"num_envs = {self.num_envs} with rollout_steps = {self.rollout_steps}"
        samples = self.num_envs * self.rollout_steps
        require_memory(given, "samples", samples, 8 * (observation + 8))
        given = f"batch_size = {self.batch_size} with hidden = {self.hidden}"
        wide = 2 * (observation + self.hidden * self.layers)  # forwards and back
        require_memory(given, "samples of a gradient step", self.batch_size, 4 * wide)

    @classmethod
    def fixed(cls) -> list[str]:
        """Fields that a named task decides, and that are not written beside one."""
        others = {*Configuration.__dataclass_fields__, *cls.USUALLY, *cls.LEARNING}
        return [one.name for one in fields(cls) if one.name not in others]

    @classmethod
    def of(cls, /, **given: Any) -> Self:
        """The trainer's defaults with some fields changed. ValueError for an unknown field."""
        require_known(given, [one.name for one in fields(cls)])
        given = {name: value for name, value in given.items() if value is not None}
        if "task" in given:
            refuse_fixed([name for name in cls.fixed() if name in given], str(given["task"]))
        return cls(**cls.defaults_of(given.get("trainer", cls.trainer)) | given)

    @classmethod
    def defaults_of(cls, trainer: object) -> dict[str, Any]:
        """Defaults of a trainer that differ from the fields' own."""
        own = {one.name: one.metadata.get("sb3") for one in fields(cls) if trainer == "sb3"}
        return {name: default for name, default in own.items() if default is not None}

    def to_json(self) -> str:
        """JSON text that `from_json` reads; what the named task decides is left out."""
        content: dict[str, Any] = {"format": FORMAT, "version": VERSION, "machine": self.machine}
        for one in fields(self):
            value = getattr(self, one.name)
            own = one.name in self.fixed() or (one.name in self.USUALLY and value is None)
            if (self.task is None or not own) and not (one.name == self.OWN and value is None):
                content[one.name] = value
        return json.dumps(content, indent=2) + "\n"

    @classmethod
    def from_json(cls, text: str) -> Self:
        """The configuration in a JSON text; fields that are missing have the trainer's defaults.

        ValueError saying what is wrong with it.
        """
        entries = cls.own_entries(content_of(text))
        return cls(**cls.defaults_of(entries.get("trainer", cls.trainer)) | entries)

    @classmethod
    def own_entries(cls, content: Mapping[str, untrusted.Json]) -> dict[str, Any]:
        """A file's entries by field. ValueError for another machine's and for unknown ones."""
        if (machine := content.get("machine", cls.machine)) != cls.machine:
            raise untrusted.RefusedError(f"it is of the {shown(machine)}, not of the {cls.machine}")
        found = {name: value for name, value in content.items() if name != "machine"}
        require_known(found, [one.name for one in fields(cls)])
        return found

    @property
    def digest(self) -> str:
        """A name for exactly this configuration."""
        return digest_of(self.to_json())


def digest_of(text: str) -> str:
    """Digest of a configuration's JSON text."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def shared(name: str, default: T, sb3: T | None = None) -> T:
    """Configuration's field of that name, with a machine's own default; sb3: with that trainer."""
    known = Configuration.__dataclass_fields__[name].metadata
    return field(default=default, metadata={**known, "sb3": sb3})


def content_of(text: str) -> dict[str, untrusted.Json]:
    """The entries of a configuration's JSON text, without its head. ValueError if it is none."""
    content, kind = untrusted.parse_json(text, "it"), "the configuration of a training run"
    return untrusted.require_head(content, FORMAT, VERSION, kind)


def own_task(name: str, machine: str) -> str:
    """The task's plain name. ValueError for an unknown task, and for one of another machine."""
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
    words = ["stickslip", "train", config.machine]
    words += [] if config.task is None else ["--task", config.task]
    settings = []
    for name, value in changes(config).items():
        if name not in config.FLAGS:
            settings.append(f"{name}={_text(value)}")
        elif name != "task":
            words += ["--" + name.replace("_", "-"), _text(value)]
    words += [] if out is None else ["--out", out]
    return shlex.join([*words, *(["--set", *settings] if settings else [])])


def changes(config: Configuration) -> dict[str, object]:
    """Fields by name that differ from their defaults; `of` makes the configuration of them."""
    kind = type(config)
    defaults = vars(kind.of(task=config.task, trainer=config.trainer))
    defaults |= {"trainer": kind.trainer, "task": None}
    return {name: value for name, value in vars(config).items() if value != defaults[name]}


def settings_given(given: Mapping[str, Any], kind: type[Configuration]) -> dict[str, object]:
    """Fields by name, of --config FILE and of the command line, which takes precedence."""
    found: dict[str, Any] = {}
    if given.get("config") is not None:
        found |= read_settings(given["config"], kind)
    found |= {one.name: given[one.name] for one in fields(kind) if one.name in given}
    path = found.get(kind.OWN)
    if path is not None or given.get("changes"):
        found |= kind.own_machine(path, given.get("changes") or {})
    return found


def read_settings(path: str | Path, kind: type[Configuration]) -> Mapping[str, object]:
    """Fields by name in a TOML file, or those of a run's config.json that are no defaults.

    ValueError, naming the file, for anything else and for another machine's.
    """
    with reraise(f"{path}: ", "; accepted: a TOML file of settings, or a run's config.json"):
        text = untrusted.read_text(path)
        if Path(path).suffix.lower() == ".json":
            return changes(kind.from_json(text))
        with untrusted.refusing("it"):
            content = tomllib.loads(text)
        return kind.own_entries({"machine": kind.machine} | content)


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
