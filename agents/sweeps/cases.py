"""Policies on tasks, as a user names them in Python or on the command line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from stickslip.agents.evaluation.players import controller_of, given_flags, places_of, read_named
from stickslip.agents.evaluation.rollout import validated
from stickslip.agents.registry import machine_by_name, machine_of_env
from stickslip.dynamics.checks import require_kind, shown
from stickslip.envs.functional import FunctionalEnv
from stickslip.envs.tasks.definition import task_by_name

if TYPE_CHECKING:
    from stickslip.agents.machine import AnyMachine
    from stickslip.agents.protocol import AnyEnv, AnyPlayer, Options, Timed

    Pair: TypeAlias = tuple[AnyEnv, Timed]
    Tasks: TypeAlias = str | Pair | Sequence[str] | Mapping[str, Pair]
    """A named task, or an environment and its parameters, or several."""
    Policies: TypeAlias = str | Sequence[str] | Mapping[str, AnyPlayer]
    """Names of baselines and policy files, or controllers by names of one's own."""


class Given(NamedTuple):
    """A policy on a task, as the user gave it."""

    task: str
    policy: str
    env: AnyEnv
    params: Timed
    player: AnyPlayer


def cases_on(task: Tasks, policies: Policies) -> tuple[AnyMachine, list[Given]]:
    """Every policy on every task, task by task. ValueError for unknown ones and two machines."""
    tasks = _tasks(task)
    machines = {machine_of_env(env).name for env, _ in tasks.values()}
    if len(machines) != 1:
        found = ", ".join(sorted(machines)) or "none"
        raise ValueError(f"tasks of {found}; accepted: those of one machine, at least one")
    machine = machine_by_name(machines.pop())
    units = {machine.unit_of(env) for env, _ in tasks.values()}
    if len(units) > 1:
        raise ValueError(f"tasks in {' and '.join(sorted(units))}; accepted: of one criterion")
    found = []
    for label, (env, params) in tasks.items():
        env.check_params(params)
        players = _players(policies, env, params, machine)
        found += [Given(label, name, env, params, one) for name, one in players.items()]
    return machine, found


def cases_named(
    machine: AnyMachine, who: Sequence[str], options: Options, tasks: Sequence[str] | None
) -> tuple[list[Given], str]:
    """The cases of a command line and a description: on named tasks, or on the policies' own task
    changed by options. ValueError where policies have several tasks of their own."""
    _require_once(who)
    if tasks:
        if given := given_flags(options):
            raise ValueError(f"{', '.join(given)} with --task; accepted: one of them, or an --axis")
        named = [task_by_name(one) for one in tasks]
        if others := [one.name for one in named if one.machine != machine.name]:
            raise ValueError(f"--task {others[0]}; accepted: tasks of the {machine.title}")
        _, found = cases_on([one.name for one in named], list(who))
        return found, "\n".join(f"{one.name}: {one.title}" for one in named)
    players = read_named(who, machine)
    places = places_of(players, options, machine)
    if len(places) > 1:
        labels = "; ".join(place.label for place in places)
        raise ValueError(
            f"{len(places)} tasks: {labels}; accepted: policies of one task, or --task NAME for all"
        )
    (place,) = places
    found = []
    for name, env in place.who.items():
        player = controller_of(players[name], name, env, place.params, machine)
        found.append(Given(place.label, name, env, place.params, player))
    return found, place.line()


def _tasks(task: object) -> dict[str, Pair]:
    if isinstance(task, str):
        task = [task]
    if isinstance(task, tuple) and len(task) == 2 and isinstance(task[0], FunctionalEnv):
        return {"own": task}
    if isinstance(task, Mapping):
        return {str(label): pair for label, pair in task.items()}
    if not isinstance(task, Sequence):
        raise ValueError(f"task = {shown(task)}; accepted: a name, (env, params), or several")
    return {one.name: one.make() for one in map(task_by_name, task)}


def _players(
    policies: Policies, env: AnyEnv, params: Timed, machine: AnyMachine
) -> dict[str, AnyPlayer]:
    if isinstance(policies, Mapping):
        given = policies.items()
        return {str(name): validated(f"policies[{name!r}]", one) for name, one in given}
    require_kind("policies", policies, (str, Sequence), "names, or controllers by name in a dict")
    names = [policies] if isinstance(policies, str) else list(policies)
    _require_once(names)
    read = read_named(names, machine)
    return {name: controller_of(read[name], name, env, params, machine) for name in read}


def _require_once(names: Sequence[str]) -> None:
    if twice := next((one for one in names if list(names).count(one) > 1), None):
        raise ValueError(f"{twice} is given twice; accepted: each policy once")
