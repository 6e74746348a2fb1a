"""Tasks and policies of a sweep, by name or as they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, TypeAlias

from stickslip.agents.evaluation.given import validated_player
from stickslip.agents.registry import machine_by_name, machine_of_baseline, machine_of_env
from stickslip.agents.sweeps.playing.case import Played
from stickslip.agents.sweeps.worded import worded
from stickslip.agents.tasks.places import (
    controller_of,
    every_option,
    places_of,
    read_named,
)
from stickslip.dynamics.checks import require_kind, shown
from stickslip.envs.functional import FunctionalEnv
from stickslip.envs.tasks.ladder import task_by_name

if TYPE_CHECKING:
    from stickslip.agents.machine import AnyMachine, Options
    from stickslip.agents.protocol import AnyEnv, AnyPlayer, Timed
    from stickslip.agents.sweeps.design import Design

    Pair: TypeAlias = tuple[AnyEnv, Timed]
    Tasks: TypeAlias = str | Pair | Sequence[str] | Mapping[str, Pair]
    """A task or several: of the ladder by name, or an environment and its parameters."""
    Policies: TypeAlias = str | Sequence[str] | Mapping[str, AnyPlayer]
    """Names of baselines and policy files, or controllers by names of one's own."""

OWN = "own"
"""The label of a task that is given without one."""


def played_on(task: Tasks, policies: Policies) -> tuple[AnyMachine, list[Played]]:
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
        found += [Played(label, name, env, params, one) for name, one in players.items()]
    return machine, found


def played_by(
    machine: AnyMachine,
    who: Sequence[str],
    options: Options,
    tasks: Sequence[str] | None,
    design: Design,
) -> tuple[list[Played], str]:
    """Those named on a command line on tasks of the ladder or, as `evaluate` has it, on their own
    changed by options; and what the task is, in words, without what axes replace.

    ValueError where policies have several tasks of their own: a sweep plays all on the same.
    """
    if tasks:
        given = [f"--{name}" for name in ("scene",) if options["scenes"]]
        given += [
            one.flag for name, (one, _) in every_option().items() if options[name] is not None
        ]
        if given:
            raise ValueError(
                f"{', '.join(given)} with --task; accepted: one or the other, or the number as an "
                "--axis NAME=VALUE"
            )
        named = [task_by_name(one) for one in tasks]
        for one in named:
            if one.machine != machine.name:
                owner = machine_by_name(one.machine).title
                raise ValueError(
                    f"--task {one.name} is the {owner}'s; accepted: tasks of the {machine.title}"
                )
        _require_own(who, machine)
        _, found = played_on([one.name for one in named], list(who))
        lines = []
        for one in named:
            env, params = next((it.env, it.params) for it in found if it.task == one.name)
            lost = worded(machine, env, params, design, "", "").replaced
            lines.append(f"{one.name}: {one.title}")
            lines += [f"  replaced by axes: {', '.join(lost)}"] if lost else []
        return found, "\n".join(lines)
    _require_own(who, machine)
    players = read_named(who, machine)
    places = places_of(players, options, machine)
    if len(places) > 1:
        labels = "; ".join(place.label for place in places)
        raise ValueError(
            f"{len(places)} tasks: {labels}; accepted: one --scene, or policies of one task, or "
            "--task NAME for all"
        )
    (place,) = places
    env = next(iter(place.who.values()))
    left = worded(machine, env, place.params, design, place.label, place.details)
    place = replace(place, label=left.label or machine.title, details=left.details)
    found = [
        Played(
            place.label,
            name,
            env,
            place.params,
            controller_of(players[name], name, env, place.params, machine),
        )
        for name, env in place.who.items()
    ]
    return found, place.line()


def _tasks(task: object) -> dict[str, Pair]:
    if isinstance(task, str):
        task = [task]
    if isinstance(task, tuple) and len(task) == 2 and isinstance(task[0], FunctionalEnv):
        return {OWN: task}
    if isinstance(task, Mapping):
        return {str(label): pair for label, pair in task.items()}
    if not isinstance(task, Sequence):
        raise ValueError(f"task = {shown(task)}; accepted: a name, (env, params), or several")
    return {one.name: one.make() for one in map(task_by_name, task)}


def _players(
    policies: Policies, env: AnyEnv, params: Timed, machine: AnyMachine
) -> dict[str, AnyPlayer]:
    if isinstance(policies, Mapping):
        return {
            str(name): validated_player(f"policies[{name!r}]", one)
            for name, one in policies.items()
        }
    require_kind("policies", policies, (str, Sequence), "names, or controllers by name in a dict")
    names = [policies] if isinstance(policies, str) else list(policies)
    _require_own(names, machine)
    return {
        name: controller_of(one, name, env, params, machine)
        for name, one in read_named(names, machine).items()
    }


def _require_own(names: Sequence[str], machine: AnyMachine) -> None:
    """ValueError for a name given twice, and for baselines of another machine."""
    names = list(names)
    if twice := next((one for one in names if names.count(one) > 1), None):
        raise ValueError(f"{twice} is given twice; accepted: each policy once")
    for name in names:
        owner = machine_of_baseline(name)
        if owner is not None and owner is not machine:
            raise ValueError(
                f"{name!r} is a baseline of the {owner.title}; accepted: "
                f"{', '.join(machine.baselines)}, or a policy file"
            )
