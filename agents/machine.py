"""Interface of a machine to training, evaluation, pictures and the command line.

Shared code asks a machine and never which one it is. What stands here, and what a machine's module
imports at its top, needs neither JAX nor NumPy, so that help is quick.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple, TypeAlias

from stickslip.agents.protocol import Env, Options, Params, Task
from stickslip.agents.training.configuration import Config, Configuration
from stickslip.dynamics.checks import require_choice, shown

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Sequence

    import numpy as np

    from stickslip.agents.evaluation.rollout import AnyRollout
    from stickslip.agents.evaluation.table import AnyMeasures, Evaluation
    from stickslip.agents.optimum.policy import StateMap
    from stickslip.agents.pictures.episodes import LearningPanel
    from stickslip.agents.protocol import AnyPlayer, Policy
    from stickslip.agents.sweeps.swept import Swept
    from stickslip.agents.training.configuration import Trained
    from stickslip.agents.untrusted import Json
    from stickslip.envs.rendering.page import Episode
    from stickslip.envs.tasks.known import Scale


Parts: TypeAlias = dict[str, Any]
"""Parts of a task by name, of a machine's own kinds."""


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


class TrainingTask(NamedTuple, Generic[Env, Params]):
    """An environment and its parameters during a training run."""

    env: Env
    training: Params
    tested: Params
    """Of evaluations."""
    described: Params
    """In the policy's file."""


class Demonstration(ABC, Generic[Config]):
    """One machine's demo: what is trained, and how the policy is compared and shown."""

    directory: ClassVar[str] = "demo"
    """Name of the run's directory."""
    files: ClassVar[Mapping[str, str]]
    """Products in the run's directory with their descriptions."""

    @abstractmethod
    def config(self) -> Config:
        """Training configuration."""

    @abstractmethod
    def task_in_words(self, config: Config) -> str:
        """Text of the task, in a line or two."""

    @abstractmethod
    def show(self, trained: Trained[Config], say: Callable[[str], None]) -> str:
        """Compare the policy with the baselines, say so, write `files` and return what was said.

        say: also called with what goes on.
        """

    def write_tables(self, trained: Trained[Config], table: Evaluation) -> None:
        """Write table.csv and table.json into the run's directory."""
        about = {"config": trained.config.digest, "timesteps": trained.timesteps}
        table.write_csv(trained.directory / "table.csv")
        table.write_json(trained.directory / "table.json", about)


def defined_in(module: str, name: str = "") -> Any:
    """A machine's method whose function, of the same name unless given, stands in another module.

    The module is imported at the first call. The function does not take the machine.
    """
    return _DefinedIn(module, name)


class _DefinedIn:
    """See `defined_in`."""

    def __init__(self, module: str, name: str):
        self.module, self.name = module, name

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = self.name or name

    def __get__(self, machine: object, kind: type) -> object:
        """The function."""
        return getattr(import_module(self.module), self.name)


class Machine(ABC, Generic[Env, Params, Config]):
    """One machine, registered by name (see stickslip.agents.registry).

    To be said of a new one: the names without a value here, `env`, `with_scene` where there are
    scenes, `baseline` where there are any, and `training_task` where training differs from the
    standard task. The environment is a dataclass; its parameters are one, too, with `time_limit`
    and `control_period`, their classes stand in `modules`, and options that change a task have the
    names of their fields. Infos hold "episode_return" and "episode_length" (steps so far).
    """

    name: ClassVar[str]
    """On the command line and in configurations."""
    title: ClassVar[str]
    """In sentences and titles."""
    environment: ClassVar[str]
    """Name of the environment's class, by which a policy's file says whose it is."""
    configuration: ClassVar[type[Configuration]]
    """Of its training runs."""
    modules: ClassVar[tuple[str, ...]] = ()
    """Full names of the modules whose dataclasses a task in a policy's file is made of."""
    baselines: ClassVar[tuple[str, ...]] = ()
    scenes: ClassVar[tuple[str, ...]] = ()
    """Floors or grounds by name."""
    scene_files: ClassVar[str] = ""
    """Description of files that may be named instead."""
    axes: ClassVar[Mapping[str, str]] = {}
    """Some of the numbers that a sweep may vary, with descriptions and units."""
    evaluated: ClassVar[tuple[str, ...]] = ("return", "duration", "failures")
    """Columns of evaluations.csv; "return" among them."""
    episode: ClassVar[tuple[str, ...]] = ("episodes", "return", "duration")
    """Columns of metrics.csv about the training episodes."""
    film: ClassVar[str] = "episode.gif"
    """Name of the animation that a finished run leaves."""
    frames: ClassVar[float] = 25.0
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
    def env(self) -> Env:
        """The environment of the standard task."""

    def standard_task(self) -> Task[Env, Params]:
        """The task of baselines alone, and of a policy whose file holds none."""
        env = self.env()
        return Task(env, env.default_params)

    def with_scene(self, params: Params, scene: str) -> Params:
        """The parameters in a scene of `scenes`."""
        raise NotImplementedError(f"{type(self).__name__}.with_scene, which its scenes need")

    def with_options(
        self, task: Task[Env, Params], options: Options, scene: str | None, viewed: bool
    ) -> Task[Env, Params]:
        """The task with what the options ask for instead, for `evaluate` or for `view`.

        options: by name, None where one is not given. ValueError where they will not do.
        """
        from stickslip.agents.policy.task import with_fields

        if scene is not None:
            if not self.scenes:
                raise ValueError(f"scene {shown(scene)}; accepted: none, the {self.title} has none")
            require_choice("scene", scene, self.scenes)
            task = task._replace(params=self.with_scene(task.params, scene))
        return task._replace(params=with_fields(task.params, options))

    def label(self, task: Task[Env, Params], scene: str | None) -> str:
        """A few words for a row."""
        return scene or "standard"

    def details(self, task: Task[Env, Params]) -> str:
        """The numbers of a task in a line."""
        from stickslip.agents.policy.task import numbers_in_words

        return numbers_in_words(vars(task.params))

    def parts(self, env: Env, params: Params) -> Parts:
        """The parts of a task that a policy's file holds, the environment among them."""
        return {"env": env, "values": params}

    def build(self, *, env: Env, values: Params) -> Task[Env, Params]:
        """The task of its parts. ValueError for parts that will not do."""
        env.check_params(values)
        env.observation_bounds(values)  # for what only it knows
        return Task(env, values)

    def describe(self, env: Env, params: Params) -> dict[str, Json]:
        """An environment and its parameters as JSON values, for a policy's file."""
        from stickslip.agents.policy.task import described

        return described(env, params, self.parts(env, params), self.modules)

    def read_task(self, metadata: Mapping[str, Json]) -> Task[Env, Params] | None:
        """The task that a policy's file holds; None if it holds none. ValueError if damaged."""
        from stickslip.agents.policy.task import read_task

        return read_task(metadata, self.build, self.environment, self.modules)

    def sightless(self, env: Env) -> Env:
        """The environment without what only changes what is observed."""
        return env

    def unit_of(self, env: Env) -> str:
        """What a table's columns depend on; environments of one table have the same."""
        return ""

    def baseline(self, name: str, env: Env) -> AnyPlayer:
        """A baseline for an environment. ValueError for an unknown name."""
        raise ValueError(f"baseline {name!r} is unknown; accepted: none, the {self.title} has none")

    def state_map(self, env: Env, params: Params) -> StateMap[Any, Params]:
        """The coordinates that later rewards of a task depend on, for `stickslip.agents.optimum`.

        ValueError where they are too many, or nobody has said which they are.
        """
        raise ValueError(
            f"nobody has said which coordinates the state of {type(env).__name__} has; accepted: "
            "an environment whose machine says so, or states= of your own"
        )

    # Evaluation.

    def measures(self, env: Env, *, task: bool = False, bound: bool = False) -> AnyMeasures:
        """What is kept of an environment's episodes, and the columns of its tables.

        task: of a named task, whose scores say what an optimum would. bound: with columns of what
        nobody can beat in each episode, computed and proved; ValueError where nothing is.
        """
        from stickslip.agents.evaluation.table import MEASURES

        self.require_no_bound(bound)
        return MEASURES

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

    def swept(self) -> Swept:
        """What a sweep may vary of its tasks, and what it writes of an episode."""
        from stickslip.agents.sweeps.swept import Swept

        return Swept()

    # Training.

    def training_task(self, config: Config) -> TrainingTask[Env, Params]:
        """The task of a training run. ValueError for numbers that do not go together."""
        env, params = self.standard_task()
        return TrainingTask(env, params, params, params)

    def evaluate_policy(
        self, task: TrainingTask[Env, Params], policy: Policy, config: Config
    ) -> dict[str, float]:
        """A row of evaluations.csv: `evaluated`."""
        from stickslip.agents.evaluation.rollout import play_unseen
        from stickslip.agents.evaluation.table import row_of_test

        measures, count = self.measures(task.env), config.evaluation_episodes
        played = play_unseen(task.env, policy, task.tested, count, measures.keep)
        return row_of_test(measures.columns, self.evaluated, played)

    def summary(self, ended: Mapping[str, np.ndarray], period: float) -> dict[str, float]:
        """`episode` of training episodes. ended: what the last infos held, each [episodes >= 1];
        period: of a step [s]."""
        return {
            "episodes": len(ended["episode_return"]),
            "return": float(ended["episode_return"].mean()),
            "duration": float(ended["episode_length"].mean()) * period,
        }

    def line(self, row: Mapping[str, float]) -> str:
        """An evaluation in a line."""
        given = (name for name in self.evaluated if name in row)
        return "  ".join(f"{name.replace('_', ' ')} {row[name]:.4g}" for name in given)

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
