"""Interface of a machine to training, evaluation, pictures and the command line.

Shared code asks a machine and never which one it is. What stands here, and what a machine's module
imports at its top, needs neither JAX nor NumPy, so that help is quick.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple, TypeAlias

from stickslip.agents.protocol import Env, Options, Params, Player, Task
from stickslip.agents.training.configuration import Config, Configuration, content_of
from stickslip.agents.untrusted import Json, RefusedError
from stickslip.dynamics.checks import nearest, require_choice, shown

if TYPE_CHECKING:
    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.agents.evaluation.table import Measures
    from stickslip.agents.sweeps.swept import Swept
    from stickslip.envs.functional import AnyEnv
    from stickslip.envs.rendering.page import Episode
    from stickslip.envs.tasks.known import Scale


Parts: TypeAlias = dict[str, Any]
"""Parts of a task by name, of a machine's own kinds."""


class TrainingTask(NamedTuple, Generic[Env, Params]):
    """An environment and its parameters during a training run."""

    env: Env
    training: Params
    tested: Params
    """Parameters of evaluations."""
    described: Params
    """Parameters in the policy's file."""


class Machine(ABC, Generic[Env, Params, Config]):
    """One machine, registered by name (see `register`).

    To be said of a new one: the names without a value here, `env`, `with_scene` where there are
    scenes, `baseline` where there are any, and `training_task` where training differs from the
    standard task. The environment is a dataclass; its parameters are one, too, with `time_limit`
    and `control_period`, their classes stand in `modules`. Infos hold "episode_return" and
    "episode_length" (steps so far).
    """

    name: ClassVar[str]
    """Name on the command line and in configurations."""
    title: ClassVar[str]
    """Name in sentences and titles."""
    environment: ClassVar[str]
    """Name of the environment's class, by which a policy's file says whose it is."""
    configuration: ClassVar[type[Configuration]]
    """Configuration of its training runs."""
    modules: ClassVar[tuple[str, ...]] = ()
    """Full names of the modules whose dataclasses a task in a policy's file is made of."""
    baselines: ClassVar[Collection[str]] = ()
    """By name; a mapping says the class of each, as "module:Class" of this package."""
    scenes: ClassVar[tuple[str, ...]] = ()
    """Floors or grounds by name."""
    scene_files: ClassVar[str] = ""
    """Description of files that may be named instead."""
    axes: ClassVar[Mapping[str, str]] = {}
    """Some of the numbers that a sweep may vary, with descriptions and units."""
    evaluated: ClassVar[tuple[str, ...]] = ("return", "duration", "failures")
    """Columns of evaluations.csv; "return" among them."""
    frames: ClassVar[float] = 25.0
    """Pictures a second of animations, at most one a control step."""
    film_time: ClassVar[float | None] = None
    """Seconds of the episode in a run's animation; None: all of it."""

    viewed_scene: ClassVar[str | None] = None
    """Scene of baselines alone in `view`, by default the first, as in `evaluate`."""
    options: ClassVar[Mapping[str, Mapping[str, Any]]] = {}
    """Flags of `evaluate`, `view` and `sweep` beside numbers: `add_argument` options by name."""
    tables: ClassVar[Mapping[str, Mapping[str, str]]] = {}
    """More names for the end of the help, by title."""
    functions: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Methods that stand in modules as functions without the machine: names by module."""

    def __init_subclass__(cls) -> None:
        for module, names in cls.functions.items():
            for name in names:
                place = f"{module}:{name}"  # imported when it is used
                setattr(cls, name, property(lambda _, place=place: resolve_name(place)))

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

        options: by name, None where not given; numbers: by names of axes. ValueError for bad ones.
        """
        if scene is not None:
            if not self.scenes:
                raise ValueError(f"scene {shown(scene)}; accepted: none, the {self.title} has none")
            require_choice("scene", scene, self.scenes)
            task = task._replace(params=self.with_scene(task.params, scene))
        return task._replace(params=self.swept().changed(task.params, options["numbers"]))

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

    def unit_of(self, env: Env) -> str:
        """Unit on which a table's columns depend; environments of one table share it."""
        return ""

    def baseline(self, name: str, env: Env) -> Player:
        """A baseline, of the environment where it has a field for one. ValueError if unknown."""
        places = self.baselines if isinstance(self.baselines, Mapping) else {}
        require_choice("baseline", name, tuple(places))
        kind = resolve_name(f"stickslip.agents.{places[name]}")
        return kind(env=env) if "env" in kind.__dataclass_fields__ else kind()

    def moved_by(self, env: Env, program: str) -> Env:
        """The environment with its motion computed by another program. ValueError for none."""
        raise ValueError(f"--in {program} with the {self.title}; accepted: none, or the biped")

    # Evaluation.

    def regrets(self, env: Env, params: Params) -> Callable[[Rollout, int], Mapping[str, Any]]:
        """Infos `value` and `regret` of an episode's rows. ValueError without such a planner."""
        raise ValueError(f"regret with the {self.title}; accepted: none, or a task of the UGV")

    def measures(self, env: Env) -> Measures:
        """Kept values of an environment's episodes, and the columns of its tables."""
        from stickslip.agents.evaluation.table import MEASURES

        return MEASURES

    def swept(self) -> Swept:
        """Numbers of its tasks that a sweep may vary."""
        from stickslip.agents.sweeps.swept import Swept

        return Swept()

    # Training.

    def training_task(self, config: Config) -> TrainingTask[Env, Params]:
        """The task of a training run. ValueError for numbers that do not go together."""
        env, params = self.standard_task()
        return TrainingTask(env, params, params, params)

    # Pictures.

    def as_episode(
        self, rollout: Rollout, env: Env, params: Params, name: str, scale: Scale | None = None
    ) -> Episode:
        """An episode for plots and pages; name: of the player, scale: of a named task's scores.

        Unless a machine says more: curves over time, without a drawing.
        """
        from stickslip.agents.pictures.episodes import standard_episode

        return standard_episode(rollout, env, params, name, scale)

    def params_to_view(self, params: Params, seconds: float) -> Params:
        """The parameters of an episode of which so much is shown [s]."""
        return params


_MACHINES: dict[str, Machine | str] = {
    "biped": "stickslip.agents.biped.machine:BipedMachine",
    "ugv": "stickslip.agents.ugv.machine:UGVMachine",
}
"""Machines by name, or their classes, which are imported when they are used."""


def register(machine: Machine) -> None:
    """Make a machine known to training, evaluation, policy files and the command line.

    ValueError where its name, its environment or a baseline's name is another machine's; a machine
    of a name and class that are registered takes the place of the one before.
    """
    for other in machines():
        if other.name == machine.name and type(other).__name__ == type(machine).__name__:
            continue
        taken = {other.name, other.environment, *other.baselines}
        if common := taken & {machine.name, machine.environment, *machine.baselines}:
            raise ValueError(
                f"{', '.join(sorted(common))} is known from the {other.title}; accepted: names, "
                "environments and baselines that no other machine has"
            )
    _MACHINES[machine.name] = machine


def machines() -> tuple[Machine, ...]:
    """All machines in order of their registration; the first is the default."""
    return tuple(map(machine_by_name, _MACHINES))


def environments() -> dict[str, str]:
    """Names of all machines, in the same order, and of their environments' classes."""
    return {one.name: one.environment for one in machines()}


def machine_by_name(name: str) -> Machine:
    """The machine of a name. ValueError for an unknown one."""
    require_choice("machine", name, tuple(_MACHINES))
    found = _MACHINES[name]
    if isinstance(found, str):
        found = _MACHINES[name] = resolve_name(found)()
    return found


def machine_of_env(env: AnyEnv) -> Machine:
    """The machine of an environment, or of what its class inherits from. ValueError for none."""
    kinds = (machine_of_environment(kind.__name__) for kind in type(env).__mro__)
    found = next((one for one in kinds if one is not None), None)
    if found is None:
        known = ", ".join(environments().values())
        raise ValueError(f"env is a {type(env).__name__}; accepted: {known}")
    return found


def machine_of_environment(environment: Json) -> Machine | None:
    """The machine whose environment's class has that name, if there is one."""
    return next((one for one in machines() if one.environment == environment), None)


def machine_of_baseline(name: str) -> Machine | None:
    """The machine that has a baseline of that name, if there is one."""
    return next((one for one in machines() if name in one.baselines), None)


def read_configuration(text: str) -> Configuration:
    """The configuration in a JSON text, of whichever machine, or ValueError."""
    name = content_of(text).get("machine")
    if not isinstance(name, str) or name not in _MACHINES:
        known = f"{', '.join(_MACHINES)}{nearest(name, _MACHINES)}"
        raise RefusedError(f"its machine is {shown(name)}, not one of {known}")
    return machine_by_name(name).configuration.from_json(text)
