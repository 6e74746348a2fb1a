"""What a machine is to training, evaluation, pictures and the command line.

Shared code asks a machine and never which one it is. What stands here, and what a machine's module
imports at its top, needs neither JAX nor NumPy, so that help is quick; methods import what they
work with.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Protocol, Self, TypeAlias, TypeVar

from stickslip.agents.protocol import Env, Params
from stickslip.agents.training.configuration import Config, Configuration

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

    import numpy as np

    from stickslip.agents.demonstration import Demonstration
    from stickslip.agents.evaluation.evaluate import AnyMeasures
    from stickslip.agents.evaluation.rollout import AnyRollout
    from stickslip.agents.optimum.policy import StateMap
    from stickslip.agents.pictures.episodes import LearningPanel
    from stickslip.agents.protocol import AnyEnv, AnyPlayer, Policy, Timed
    from stickslip.agents.sweeps.swept import Swept
    from stickslip.agents.untrusted import Json
    from stickslip.envs.rendering.page import Episode
    from stickslip.envs.tasks.known import Scale

Env_co = TypeVar("Env_co", bound="AnyEnv", covariant=True)
Params_co = TypeVar("Params_co", bound="Timed", covariant=True)

Options: TypeAlias = Mapping[str, Any]
"""Parsed flags by name, each of its Option's kind; None for one that is not given."""


@dataclass(frozen=True)
class Option:
    """A flag of `evaluate` and `view` that changes a task: --name, or --na-me for na_me."""

    name: str
    about: str
    kind: type = float
    metavar: str | None = None
    choices: tuple[str, ...] | None = None

    @property
    def flag(self) -> str:
        """As it stands on the command line."""
        return "--" + self.name.replace("_", "-")

    def add_to(self, group: argparse._ArgumentGroup) -> None:
        """Make it a flag of a command."""
        group.add_argument(
            self.flag,
            type=self.kind,
            metavar=self.metavar,
            choices=self.choices,
            help=self.about,
        )


class Task(Protocol[Env_co, Params_co]):
    """A task in parts, which options change before an environment's parameters are made of it.

    options: the options by name, None where one is not given.
    """

    @property
    def env(self) -> Env_co:
        """The environment's static choices."""
        ...

    def params(self) -> Params_co:
        """The environment's parameters; ValueError where the parts will not do."""
        ...

    def with_options(self, options: Options, scene: str | None) -> Self:
        """The task with what the options ask for instead."""
        ...

    def label(self, scene: str | None) -> str:
        """A few words for a row."""
        ...

    def details(self) -> str:
        """The numbers in a line."""
        ...


class TrainingTask(Protocol[Env_co, Params_co]):
    """What a configuration asks of the environment."""

    @property
    def env(self) -> Env_co:
        """The environment's static choices."""
        ...

    @property
    def training(self) -> Params_co:
        """The parameters of training episodes."""
        ...

    @property
    def tested(self) -> Params_co:
        """The parameters that a policy is trained for, which its file tells of."""
        ...


class Machine(ABC, Generic[Env, Params, Config]):
    """One machine, registered by name (see stickslip.agents.registry).

    StandardMachine has what does for most machines: see there for how little one must say.
    """

    name: ClassVar[str]
    """On the command line and in configurations."""
    title: ClassVar[str]
    """In sentences and titles."""
    environment: ClassVar[str]
    """Name of the environment's class, by which a policy's file says whose it is."""
    outputs: ClassVar[int]
    """Numbers in an action."""
    configuration: ClassVar[type[Configuration]]
    """Of its training runs."""
    modules: ClassVar[tuple[str, ...]] = ()
    """Full names of the modules whose dataclasses a task in a policy's file is made of."""
    baselines: ClassVar[tuple[str, ...]] = ()
    scenes: ClassVar[tuple[str, ...]] = ()
    """Floors or grounds by name."""
    scene_files: ClassVar[str] = ""
    """What may be named instead, in words."""
    axes: ClassVar[Mapping[str, str]] = {}
    """Some of the numbers that a sweep may vary, and what each is, with its unit."""
    evaluated: ClassVar[tuple[str, ...]]
    """What evaluations.csv holds of each evaluation; "return" among it."""
    episode: ClassVar[tuple[str, ...]]
    """What metrics.csv holds of the training episodes."""
    film: ClassVar[str]
    """Name of the animation that a finished run leaves."""
    frames: ClassVar[float]
    """Pictures a second of animations, at most one a control step."""
    film_time: ClassVar[float | None] = None
    """Seconds of the episode in a run's animation; None: all of it."""

    # What the command line shows before anything is computed.

    def usual_scene(self, viewed: bool = False) -> str:
        """The scene where none is named; viewed: of a baseline alone in `view`."""
        return self.scenes[0] if self.scenes else ""

    def options(self, viewed: bool = False) -> tuple[Option, ...]:
        """The flags that change a task in `evaluate`, or in `view`."""
        return ()

    def require_options(self, options: Options) -> None:
        """Raise ValueError for options that contradict each other; "scenes" is among them."""
        del options

    def tables(self) -> dict[str, Mapping[str, str]]:
        """More names for the end of the help, by title."""
        return {}

    # Tasks.

    @abstractmethod
    def describe(self, env: Env, params: Params) -> dict[str, Json]:
        """An environment and its parameters as JSON values, for a policy's file: for people, and
        for `read_task`; under "environment" the name of its class."""

    @abstractmethod
    def read_task(self, metadata: Mapping[str, Json]) -> Task[Env, Params] | None:
        """The task that a policy's file holds; None if it holds none. ValueError if damaged."""

    @abstractmethod
    def standard_task(self, metadata: Mapping[str, Json]) -> Task[Env, Params]:
        """The one for a policy whose file holds none, and for baselines alone ({})."""

    def params_of(self, task: Task[Env, Params], options: Options, viewed: bool) -> Params:
        """The environment's parameters, for `evaluate` or for `view`."""
        return task.params()

    def sightless(self, env: Env) -> Env:
        """The environment without what only changes what is observed."""
        return env

    @abstractmethod
    def baseline(self, name: str, env: Env) -> AnyPlayer:
        """A baseline for an environment. ValueError for an unknown name."""

    def state_map(self, env: Env, params: Params) -> StateMap[Any, Params]:
        """The coordinates that later rewards of a task depend on, for `stickslip.agents.optimum`.

        ValueError where they are too many, or nobody has said which they are.
        """
        raise ValueError(
            f"nobody has said which coordinates the state of {type(env).__name__} has; accepted: "
            "an environment whose machine says so, or states= of your own"
        )

    # Evaluation.

    @abstractmethod
    def measures(self, env: Env, *, task: bool = False, bound: bool = False) -> AnyMeasures:
        """What is kept of an environment's episodes, and the columns of its tables.

        task: of a named task, whose scores say what an optimum would. bound: with columns of what
        nobody can beat in each episode, computed and proved; ValueError where nothing is.
        """

    def require_no_bound(self, bound: bool) -> None:
        """Raise ValueError if a bound is asked for, of a machine that has none."""
        if bound:
            raise ValueError(
                f"nobody has proved what no policy of the {self.title} can beat in an episode; "
                "accepted: without a bound"
            )

    def amplifications(
        self, env: Env, player: AnyPlayer, params: Params, seeds: Sequence[int]
    ) -> np.ndarray:
        """How many times a small difference of the start grew in each seed's episode [-].

        ValueError for a machine without dynamics.
        """
        raise ValueError(
            f"the {self.title} is in equilibrium everywhere: nothing grows along its episodes; "
            "accepted: without --amplification"
        )

    def unit_of(self, env: Env) -> str:
        """What a table's columns depend on; environments of one table have the same."""
        return ""

    def swept(self) -> Swept:
        """What a sweep may vary of its tasks, and what it writes of an episode."""
        from stickslip.agents.sweeps.swept import Swept

        return Swept()

    # Training.

    @abstractmethod
    def training_task(self, config: Config) -> TrainingTask[Env, Params]:
        """What to train on. ValueError for numbers that do not go together."""

    @abstractmethod
    def evaluate_policy(
        self, task: TrainingTask[Env, Params], policy: Policy, config: Config
    ) -> dict[str, float]:
        """A row of evaluations.csv: `evaluated`."""

    @abstractmethod
    def summary(self, ended: Mapping[str, np.ndarray], period: float) -> dict[str, float]:
        """`episode` of training episodes. ended: what the last infos held, each [episodes >= 1];
        period: of a step [s]."""

    @abstractmethod
    def beside_bar(self, row: Mapping[str, float]) -> str:
        """How training episodes go, in a few characters."""

    @abstractmethod
    def line(self, row: Mapping[str, float]) -> str:
        """An evaluation in a line."""

    # Pictures.

    def as_episode(
        self, played: AnyRollout, env: Env, params: Params, name: str, scale: Scale | None = None
    ) -> Episode:
        """An episode for plots and pages; name: of the player, scale: of a named task's scores.

        Unless a machine says more: curves over time, without a drawing.
        """
        from stickslip.agents.pictures.episodes import standard_episode

        return standard_episode(played, env, params, name, scale)

    def learning_panels(self, config: Config) -> Sequence[LearningPanel]:
        """Panels of a run's learning curves. Unless a machine says more: each of `evaluated`."""
        from stickslip.agents.pictures.episodes import LearningPanel

        del config
        return [
            LearningPanel(name.replace("_", " "), name if name in self.episode else None, name)
            for name in self.evaluated
        ]

    def params_to_view(self, params: Params, seconds: float) -> Params:
        """The parameters of an episode of which so much is shown [s]."""
        return params

    def demonstration(self) -> Demonstration[Config] | None:
        """What `stickslip demo` does with it, if anything."""
        return None


AnyMachine: TypeAlias = Machine[Any, Any, Any]
"""Whichever machine."""
AnyTask: TypeAlias = Task[Any, Any]
"""A task of whichever machine."""
