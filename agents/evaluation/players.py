"""Policies and baselines named on a command line, and the tasks that they are shown on."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.machine import (
    machine_by_name,
    machine_of_baseline,
    machine_of_environment,
    machines,
)
from stickslip.agents.policy.file import named_task_of, policy_path, read_metadata, read_policy
from stickslip.agents.policy.network import MLPPolicy
from stickslip.agents.policy.shipped import shipped_names
from stickslip.agents.policy.task import same_numbers
from stickslip.agents.untrusted import RefusedError
from stickslip.dynamics.checks import nearest, require_choice
from stickslip.envs.tasks.definition import task_by_name

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from stickslip.agents.machine import AnyMachine, AnyTask, Option
    from stickslip.agents.protocol import AnyEnv, AnyPlayer, Options, Timed
    from stickslip.agents.untrusted import Json


class Named(NamedTuple):
    """A policy with what its file says, or a baseline (None, {})."""

    policy: MLPPolicy | None
    metadata: dict[str, Json]


@dataclass
class Place:
    """One task with those who are to do it there."""

    label: str
    details: str
    params: Timed
    who: dict[str, AnyEnv] = field(default_factory=dict)
    """The environment of each, which shows it what it was trained on."""
    origins: list[str] = field(default_factory=list)

    def line(self) -> str:
        """Text of the task, and its origin."""
        return f"{self.label}: {', '.join(dict.fromkeys(self.origins))}\n  {self.details}"


def read_named(who: Sequence[str], machine: AnyMachine) -> dict[str, Named]:
    """Policies and baselines by name. ValueError for anything else, and for another machine's."""
    return {name: _read_named(name, machine) for name in who}


def _read_named(name: str, machine: AnyMachine) -> Named:
    owner, path, own = machine_of_baseline(name), policy_path(name), ", ".join(machine.baselines)
    if owner is machine:
        return Named(None, {})
    if owner is not None:
        raise ValueError(
            f"{name!r} is a baseline of the {owner.title}; accepted: {own}, or a policy file"
        )
    if not path.exists():
        raise ValueError(
            f"{name!r} is neither a baseline nor a file; accepted: {own}, a policy file, the "
            "directory of a run with one, or a policy of the package (`stickslip policies`)"
            f"{nearest(name, (*machine.baselines, *shipped_names()))}"
        )
    found = Named(*read_policy(path))
    if (of := found.metadata.get("environment", machine.environment)) != machine.environment:
        raise ValueError(f"{name!r} is a policy of {of}; accepted: policies of one machine")
    return found


def machine_of(who: Sequence[str]) -> AnyMachine:
    """The machine of the first name that is a baseline or a readable policy, else the first one."""
    for name in who:
        machine, path = machine_of_baseline(name), policy_path(name)
        if machine is None and path.is_file():
            environment = read_metadata(path).get("environment")
            machine = machine_of_environment(environment) or machines()[0]
        if machine is not None:
            return machine
    return machines()[0]


def controller_of(one: Named, name: str, env: AnyEnv, machine: AnyMachine) -> AnyPlayer:
    """The policy or baseline of a name, for an environment."""
    return machine.baseline(name, env) if one.policy is None else one.policy


def places_of(
    named: Mapping[str, Named], options: Options, machine: AnyMachine, viewed: bool = False
) -> list[Place]:
    """The tasks: each policy's own with the options' changes, equal ones once, for every scene.

    A baseline is shown on every one of them, on the standard task if there is no policy. options:
    those of all machines, None where one is not given, and "scenes". viewed: for `view`.
    """
    _require_options(options, machine)
    tasks = {
        name: _own_task(name, one, machine) for name, one in named.items() if one.policy is not None
    }
    if not tasks:
        tasks = {"": (machine.standard_task(), "the standard task")}
    places: list[Place] = []
    for scene in options["scenes"] or [None]:
        given = given_flags({**options, "scenes": [scene] if scene else None})
        words = " ".join(f"{flag} {value}" for flag, value in given.items())
        changes = f" with {words}" if words else ""
        for name, (task, origin) in tasks.items():
            changed = machine.with_options(task, options, scene, viewed)
            changed = changed._replace(env=without_resets(changed.env))
            place = _place_for(places, changed, machine)
            if place is None:
                label, details = machine.label(changed, scene), machine.details(changed)
                place = Place(label, details, changed.params, {"": changed.env})
                places.append(place)
            if name:
                place.who[name] = changed.env
            place.origins.append(origin + changes)
    return [_settled(place, named, places) for place in places]


def _own_task(name: str, one: Named, machine: AnyMachine) -> tuple[AnyTask, str]:
    """The task in a policy's file, and where it is from."""
    with naming(policy_path(name)):
        named = named_task_of(one.metadata)
        metadata = one.metadata if named is None else machine.describe(*named.make())
        task = machine.read_task(metadata)
    if task is not None:
        which = "" if named is None else f", {named.name}"
        return task, f"the own task of {name}{which}"
    why = one.metadata.get("task_missing")
    reason = f", {why}" if isinstance(why, str) else ""
    return machine.standard_task(), f"the standard task: {name} holds none{reason}"


def _place_for(places: list[Place], task: AnyTask, machine: AnyMachine) -> Place | None:
    """The place with exactly these parameters and an environment that computes the same."""
    for place in places:
        first = machine.sightless(next(iter(place.who.values())))
        if first == machine.sightless(task.env) and same_numbers(place.params, task.params):
            return place
    return None


def _settled(place: Place, named: Mapping[str, Named], places: list[Place]) -> Place:
    """With the baselines among those who are shown, in the order given, and a label of its own."""
    first = next(iter(place.who.values()))
    who = {
        name: place.who.get(name, first)
        for name, one in named.items()
        if one.policy is None or name in place.who
    }
    if sum(other.label == place.label for other in places) > 1:
        owner = next((name for name in place.who if name), "standard")
        return replace(place, label=f"{place.label} (of {owner})", who=who)
    return replace(place, who=who)


def require_one_table(places: Sequence[Place], machine: AnyMachine) -> None:
    """Raise ValueError for places that cannot stand in one table."""
    units = {machine.unit_of(env) for place in places for env in place.who.values()}
    if len(units) > 1:
        raise ValueError(
            f"policies trained for {' and '.join(sorted(units))} in one table; accepted: policies "
            "of one criterion, --criterion, or one at a time"
        )


def every_option() -> dict[str, tuple[Option, AnyMachine]]:
    """The options of all machines by name; of one that several have, the first one's."""
    found: dict[str, tuple[Option, AnyMachine]] = {}
    for machine in machines():
        for option in machine.options():
            found.setdefault(option.name, (option, machine))
    return found


def given_flags(options: Options) -> dict[str, str]:
    """The flags that change a task, with what is given."""
    scenes = {"--scene": ",".join(options["scenes"])} if options["scenes"] else {}
    every = ((option.flag, options[name]) for name, (option, _) in every_option().items())
    found = scenes | {flag: str(value) for flag, value in every if value is not None}
    changed = [f"{name}={text}" for name, text in (options.get("changes") or {}).items()]
    return found | ({"--set": " ".join(changed)} if changed else {})


def _require_options(options: Options, machine: AnyMachine) -> None:
    """Raise ValueError for options of another machine, or that contradict each other."""
    own = {option.name for option in machine.options()}
    for name, (option, other) in every_option().items():
        if name not in own and options[name] is not None:
            raise ValueError(
                f"{option.flag} is for the {other.title}; accepted: a policy or baseline of the "
                f"{other.title}"
            )
    for name in options.get("changes") or {}:
        part, parts = name.partition(".")[0], machine.configuration.PARTS
        require_choice("the part of --set", part, parts)
    machine.require_options(options)


def named_on(name: str, options: Options) -> dict[str, AnyPlayer]:
    """Players of a named task, by the names of options["who"].

    ValueError for an unknown task, for options that would change it, for the baselines and policies
    of another machine, and for a policy that observes something else.
    """
    task = task_by_name(name)
    machine = machine_by_name(task.machine)
    if given := given_flags(options):
        raise ValueError(
            f"{', '.join(given)} with --task {task.name}, which is fixed; accepted: one or the "
            "other"
        )
    named = read_named(options["who"], machine)  # before anything is compiled
    env, params = task.make()
    seen = len(env.observation_bounds(params)[0])
    for who, one in named.items():
        if one.policy is not None and one.policy.layer_sizes[0] != seen:
            raise ValueError(
                f"{policy_path(who)} observes {one.policy.layer_sizes[0]} numbers, {task.name} "
                f"has {seen}; accepted: a policy trained on what the task observes"
            )
    env = without_resets(env)
    return {who: controller_of(one, who, env, machine) for who, one in named.items()}


def common_task(options: Options) -> str | None:
    """The task options["task"], or else the named one that all policies of options["who"] were
    trained on: None where there is none, or where an option changes it.

    ValueError for a file that is damaged, and where its task is another one here.
    """
    if options.get("task") is not None:
        return options["task"]
    if given_flags(options):
        return None
    found = []
    who = options["who"]
    for name in [who] if isinstance(who, str) else who:
        if machine_of_baseline(name) is None and (path := policy_path(name)).is_file():
            with naming(path):
                found.append(named_task_of(read_metadata(path)))
    first = found[0] if found else None
    return None if first is None or any(one != first for one in found) else first.name


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Inside, what is refused of a file's contents is a ValueError that names the file."""
    try:
        yield
    except RefusedError as error:
        raise ValueError(f"{path}: {error}") from error
