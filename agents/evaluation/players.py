"""Policies and baselines named on a command line, and the tasks that they are shown on."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.machine import Machine, machine_of_baseline, machine_of_environment, machines
from stickslip.agents.policy.file import named_task_of, policy_path, read_policy
from stickslip.agents.policy.network import MLPPolicy
from stickslip.agents.policy.shipped import shipped_names
from stickslip.agents.policy.task import same_numbers
from stickslip.agents.protocol import Options, Player, Task
from stickslip.agents.untrusted import Json
from stickslip.dynamics.checks import nearest, require_choice, reraise
from stickslip.envs.functional import AnyEnv, Timed
from stickslip.envs.tasks.definition import task_by_name


@dataclass(frozen=True)
class Named:
    """A policy with its file's metadata, or a baseline (policy None)."""

    name: str
    machine: Machine
    policy: MLPPolicy | None = None
    metadata: Mapping[str, Json] = field(default_factory=dict)

    def player(self, env: AnyEnv, params: Timed) -> Player:
        """The policy, or the baseline made for an environment and suited to its parameters."""
        if self.policy is not None:
            return self.policy
        found: Any = self.machine.baseline(self.name, env)
        return found.suited_to(params) if hasattr(found, "suited_to") else found

    def own_task(self) -> tuple[Task[Any, Any], str]:
        """The task in a policy's file, and where it is from."""
        with reraise(f"{policy_path(self.name)}: "):
            named = named_task_of(self.metadata)
            found = self.metadata if named is None else self.machine.describe(*named.make())
            task = self.machine.read_task(found)
        if task is not None:
            which = "" if named is None else f", {named.name}"
            return task, f"the own task of {self.name}{which}"
        why = self.metadata.get("task_missing")
        reason = f", {why}" if isinstance(why, str) else ""
        return self.machine.standard_task(), f"the standard task: {self.name} holds none{reason}"


@dataclass
class Place:
    """One task with those who are to do it there."""

    label: str
    details: str
    params: Timed
    env: AnyEnv
    who: dict[str, AnyEnv] = field(default_factory=dict)
    """The environment of each, which shows it what it was trained on."""
    origins: list[str] = field(default_factory=list)

    def line(self) -> str:
        """Text of the task, and its origin."""
        return f"{self.label}: {', '.join(dict.fromkeys(self.origins))}\n  {self.details}"


def read_named(who: Sequence[str], machine: Machine | None = None) -> dict[str, Named]:
    """Policies and baselines by name. ValueError for anything else, and for two machines'.

    machine: whose they are to be, by default that of the first.
    """
    found: dict[str, Named] = {}
    for name in who:
        one = _read_named(name, machine)
        machine = machine or one.machine
        if one.machine is not machine:
            what = "baseline" if one.policy is None else "policy"
            raise ValueError(
                f"{name!r} is a {what} of the {one.machine.title}; accepted: "
                f"{', '.join(machine.baselines)}, or its policy files"
            )
        found[name] = one
    return found


def _read_named(name: str, machine: Machine | None) -> Named:
    if (owner := machine_of_baseline(name)) is not None:
        return Named(name, owner)
    usual, path = machine or machines()[0], policy_path(name)
    if not path.exists():
        raise ValueError(
            f"{name!r} is neither a baseline nor a file; accepted: {', '.join(usual.baselines)}, a "
            "policy file, the directory of a run with one, or a policy of the package "
            f"(`stickslip policies`){nearest(name, (*usual.baselines, *shipped_names()))}"
        )
    policy, metadata = read_policy(path)
    environment = metadata.get("environment", usual.environment)
    if (owner := machine_of_environment(environment)) is None:
        raise ValueError(f"{name!r} is a policy of {environment}; accepted: of a known machine")
    return Named(name, owner, policy, metadata)


def machine_of(named: Mapping[str, Named]) -> Machine:
    """The machine of those who were named."""
    return next(iter(named.values())).machine


def places_of(named: Mapping[str, Named], options: Options, viewed: bool = False) -> list[Place]:
    """The tasks: each policy's own with the options' changes, equal ones once, for every scene.

    A baseline is shown on every one of them, on the standard task if there is no policy. options:
    those of all machines, None where one is not given, and "scenes". viewed: for `view`.
    """
    machine = machine_of(named)
    _require_options(options, machine)
    tasks = {name: one.own_task() for name, one in named.items() if one.policy is not None}
    tasks = tasks or {"": (machine.standard_task(), "the standard task")}
    places: list[Place] = []
    for scene in options["scenes"] or [None]:
        given = given_flags({**options, "scenes": [scene] if scene else None})
        words = " ".join(f"{flag} {value}" for flag, value in given.items())
        for name, (task, origin) in tasks.items():
            task = machine.with_options(task, options, scene, viewed)
            env, params = without_resets(task.env), task.params
            place = next((one for one in places if same_numbers(one.params, params)), None)
            if place is None:
                label, details = machine.label(task, scene), machine.details(task)
                places.append(place := Place(label, details, params, env))
            place.who |= {name: env} if name else {}
            place.origins.append(origin + (f" with {words}" if words else ""))
    labels = [place.label for place in places]
    for place in places:
        if labels.count(place.label) > 1:
            place.label += f" (of {next(iter(place.who), 'standard')})"
        there = [name for name, one in named.items() if one.policy is None or name in place.who]
        place.who = {name: place.who.get(name, place.env) for name in there}
    return places


def every_option() -> dict[str, Machine]:
    """The names of all machines' options, and the first machine that has each."""
    return {name: machine for machine in reversed(machines()) for name in machine.options}


def given_flags(options: Options) -> dict[str, str]:
    """The flags that change a task, with what is given."""
    scenes = {"--scene": ",".join(options["scenes"])} if options["scenes"] else {}
    every = {f"--{name}": options[name] for name in every_option()}
    found = scenes | {flag: str(value) for flag, value in every.items() if value is not None}
    changed = [f"{name}={text}" for name, text in (options.get("changes") or {}).items()]
    changed += [f"{name}={value:g}" for name, value in options["numbers"].items()]
    return found | ({"--set": " ".join(changed)} if changed else {})


def _require_options(options: Options, machine: Machine) -> None:
    """Raise ValueError for options of another machine, or that contradict each other."""
    for name, other in every_option().items():
        if name not in machine.options and options[name] is not None:
            given = f"--{name} is for the {other.title}"
            raise ValueError(f"{given}; accepted: a policy or baseline of the {other.title}")
    for name in options.get("changes") or {}:
        part, parts = name.partition(".")[0], machine.configuration.PARTS
        require_choice("the part of --set", part, parts)


def require_unchanged(task: str, changes: Iterable[str]) -> None:
    """Raise ValueError for flags that would change a named task."""
    if given := ", ".join(changes):
        raise ValueError(f"{given} with --task {task}, which is fixed; accepted: one or the other")


def players_on(task: str, named: Mapping[str, Named]) -> dict[str, Player]:
    """Players of a named task. ValueError for a policy that observes something else."""
    env, params = task_by_name(task).make()
    env = without_resets(env)
    players = {who: one.player(env, params) for who, one in named.items()}
    for who, player in players.items():
        require_observed(player, str(policy_path(who)), env, params, task)
    return players


def require_observed(player: object, name: str, env: AnyEnv, params: Timed, task: str) -> None:
    """Raise ValueError for a network of other sizes than the task's observation and action."""
    if isinstance(player, MLPPolicy):
        wanted = len(env.observation_bounds(params)[0]), len(env.action_names)
        if (made := (player.observation_size, player.layer_sizes[-1])) != wanted:
            raise ValueError(
                f"{name} observes {made[0]} numbers and gives {made[1]}, {task} has {wanted[0]} "
                f"and takes {wanted[1]}; accepted: a policy trained on what the task observes"
            )


def common_task(named: Mapping[str, Named], options: Options) -> str | None:
    """The task options["task"], or else the named one that all policies were trained on: None
    where there is none, or where an option changes it."""
    if options.get("task") is not None or given_flags(options):
        return options.get("task")
    return shared_task(named)


def shared_task(named: Mapping[str, Named]) -> str | None:
    """The named task that all policies were trained on, or None."""
    own = [named_task_of(one.metadata) for one in named.values() if one.policy is not None]
    first = own[0] if own else None
    return None if first is None or any(one != first for one in own) else first.name
