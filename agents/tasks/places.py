"""On which task each of those named on the command line is shown: a policy on its own."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import jax
import numpy as np

from stickslip.agents.policy.file import named_task_of, policy_path
from stickslip.agents.policy.shipped import shipped_names
from stickslip.agents.registry import (
    machine_of_baseline,
    machine_of_environment,
    machines,
)
from stickslip.agents.tasks.players import fitted, naming, read_about, read_player
from stickslip.dynamics.checks import nearest

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stickslip.agents.machine import AnyMachine, AnyTask, Option, Options
    from stickslip.agents.protocol import AnyEnv, AnyPlayer, Timed
    from stickslip.agents.untrusted import Json


class Named(NamedTuple):
    """A policy with what its file says, or a baseline (None, {})."""

    policy: AnyPlayer | None
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
    """Policies and baselines by name. ValueError for anything else, or another machine's policy."""
    found: dict[str, Named] = {}
    for name in who:
        if name in machine.baselines:
            found[name] = Named(None, {})
            continue
        path = policy_path(name)
        if not path.exists():
            raise ValueError(
                f"{name!r} is neither a baseline nor a file; accepted: "
                f"{', '.join(machine.baselines)}, a policy file, the directory of a run with one, "
                "or a policy of the package (`stickslip policies`)"
                f"{nearest(name, (*machine.baselines, *shipped_names()))}"
            )
        policy, metadata = read_player(path)
        environment = metadata.get("environment", machine.environment)
        if environment != machine.environment:
            raise ValueError(
                f"{name!r} is a policy of {environment}; accepted: policies of one machine"
            )
        found[name] = Named(policy, metadata)
    return found


def machine_of(who: Sequence[str]) -> AnyMachine:
    """The machine of the first name that is a baseline or a readable policy, else the first one."""
    for name in who:
        machine, path = machine_of_baseline(name), policy_path(name)
        if machine is None and path.is_file():
            machine = machine_of_environment(read_about(path).get("environment"))
            return machines()[0] if machine is None else machine
        if machine is not None:
            return machine
    return machines()[0]


def places_of(
    named: Mapping[str, Named], options: Options, machine: AnyMachine, viewed: bool = False
) -> list[Place]:
    """The tasks: each policy's own with the options' changes, equal ones once, for every scene.

    A baseline is shown on every one of them, on the standard task if there is no policy. options:
    those of all machines, None where one is not given, and "scenes". viewed: for `view`.
    """
    require_own(options, machine)
    machine.require_options(options)
    tasks = {
        name: _own(name, one, machine) for name, one in named.items() if one.policy is not None
    }
    if not tasks:
        tasks = {"": (machine.standard_task({}), "the standard task")}
    places: list[Place] = []
    for scene in options["scenes"] or [None]:
        for name, (task, origin) in tasks.items():
            changed = task.with_options(options, scene)
            params = machine.params_of(changed, options, viewed)
            env = replace(changed.env, autoreset="disabled")
            place = _place_for(places, params, env, machine)
            if place is None:
                place = Place(changed.label(scene), changed.details(), params, {"": env})
                places.append(place)
            if name:
                place.who[name] = env
            place.origins.append(origin + _changes(options, scene))
    return [_settled(place, named, places) for place in places]


def every_option() -> dict[str, tuple[Option, AnyMachine]]:
    """The options of all machines by name; of one that several have, the first one's."""
    found: dict[str, tuple[Option, AnyMachine]] = {}
    for machine in machines():
        for option in machine.options():
            found.setdefault(option.name, (option, machine))
    return found


def require_own(options: Options, machine: AnyMachine) -> None:
    """Raise ValueError for options of another machine."""
    own = {option.name for option in machine.options()}
    for name, (option, other) in every_option().items():
        if name not in own and options[name] is not None:
            raise ValueError(
                f"{option.flag} is for the {other.title}; accepted: a policy or baseline of the "
                f"{other.title}"
            )


def require_one_table(places: Sequence[Place], machine: AnyMachine) -> None:
    """Raise ValueError for places that cannot stand in one table."""
    units = {machine.unit_of(env) for place in places for env in place.who.values()}
    if len(units) > 1:
        raise ValueError(
            f"policies trained for {' and '.join(sorted(units))} in one table; accepted: policies "
            "of one criterion, --criterion, or one at a time"
        )


def controller_of(
    one: Named, name: str, env: AnyEnv, params: Timed, machine: AnyMachine
) -> AnyPlayer:
    """The policy or baseline of a name, for an environment and its parameters."""
    if one.policy is None:
        return machine.baseline(name, env)
    return fitted(one.policy, name, env, params, machine)


def _own(name: str, one: Named, machine: AnyMachine) -> tuple[AnyTask, str]:
    with naming(policy_path(name)):
        named = named_task_of(one.metadata)
    metadata = one.metadata if named is None else machine.describe(*named.make())
    try:
        task = machine.read_task(metadata)
    except ValueError as error:
        raise ValueError(
            f"{policy_path(name)}: {error}; accepted: a task as training wrote it"
        ) from error
    if task is not None:
        which = "" if named is None else f", {named.name}"
        return task, f"the own task of {name}{which}"
    why = one.metadata.get("task_missing")
    reason = f", {why}" if isinstance(why, str) else ""
    return machine.standard_task(one.metadata), f"the standard task: {name} holds none{reason}"


def _place_for(
    places: list[Place], params: Timed, env: AnyEnv, machine: AnyMachine
) -> Place | None:
    """The place with exactly these parameters and an environment that computes the same."""
    for place in places:
        first = next(iter(place.who.values()))
        if machine.sightless(first) == machine.sightless(env) and _equal(place.params, params):
            return place
    return None


def _equal(one: object, other: object) -> bool:
    if jax.tree.structure(one) != jax.tree.structure(other):
        return False
    pairs = zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True)
    return all(np.array_equal(a, b) for a, b in pairs)


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


def _changes(options: Options, scene: str | None) -> str:
    """The options that changed the task, in words."""
    words = [] if scene is None else [f"--scene {scene}"]
    for name, (option, _) in every_option().items():
        if options[name] is not None:
            words.append(f"{option.flag} {options[name]}")
    return f" with {' '.join(words)}" if words else ""
