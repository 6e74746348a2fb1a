"""Cases of a sweep: a policy on a task, with a place for every axis."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from stickslip.agents.evaluation.evaluate import is_random
from stickslip.agents.evaluation.rollout import horizon, validated, without_resets
from stickslip.agents.optimum.solution import digest_of
from stickslip.agents.policy.network import MLPPolicy
from stickslip.agents.protocol import Controller, Planner
from stickslip.agents.registry import machine_by_name, machine_of_baseline, machine_of_env
from stickslip.agents.tasks.places import controller_of, every_option, places_of, read_named
from stickslip.dynamics.checks import require_kind, shown
from stickslip.envs.functional import FunctionalEnv
from stickslip.envs.tasks.definition import task_by_name

if TYPE_CHECKING:
    from jaxtyping import PyTree

    from stickslip.agents.machine import AnyMachine, Options
    from stickslip.agents.protocol import AnyEnv, AnyPlayer, Timed
    from stickslip.agents.sweeps.axes import Design

    Pair: TypeAlias = tuple[AnyEnv, Timed]
    Tasks: TypeAlias = str | Pair | Sequence[str] | Mapping[str, Pair]
    """A named task, or an environment and its parameters, or several."""
    Policies: TypeAlias = str | Sequence[str] | Mapping[str, AnyPlayer]
    """Names of baselines and policy files, or controllers by names of one's own."""

MOST_CORNERS = 4
"""Every corner of the box of up to so many axes is checked; of more axes, the ends of each."""


class Given(NamedTuple):
    """A policy on a task, as the user gave it."""

    task: str
    policy: str
    env: AnyEnv
    params: Timed
    player: AnyPlayer


@dataclass(frozen=True)
class Case:
    """A checked policy on a task.

    fields: axis -> dotted fields that it sets. steps: control steps of the longest episode.
    random: whether a reset draws anything that no axis sets.
    """

    task: str
    policy: str
    env: AnyEnv
    params: PyTree
    player: PyTree
    fields: dict[str, tuple[str, ...]]
    steps: int
    random: bool

    @property
    def place(self) -> str:
        """Digest of what decides the program beside the player."""
        return digest_of(self.env, self.params, sorted(self.fields.items()), self.steps)

    @classmethod
    def of(cls, machine: AnyMachine, given: Given, design: Design) -> Case:
        """Check a case before anything is compiled.

        ValueError naming the axis or the policy for unknown fields, values out of the task's range,
        a policy that does not fit and planners.
        """
        swept = machine.swept()
        env = without_resets(given.env)
        player = _checked_player(given, env)
        params = swept.opened(given.params, design.axes)
        fields = {name: swept.targets(params, name) for name in design.axes}
        _require_disjoint(fields)
        corners = [params]
        for values in _corners(design):
            numbers = {one: values[name] for name in values for one in fields[name]}
            try:
                corners.append(swept.put(params, numbers))
                swept.require_within(corners[-1])
            except ValueError as error:
                where = ", ".join(f"{name} = {value:g}" for name, value in values.items())
                raise ValueError(f"at {where}: {error}") from error
        steps = max(horizon(one) for one in corners)
        random = is_random(corners[-1])
        return cls(given.task, given.policy, env, params, player, fields, steps, random)


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
    if tasks:
        given = ["--scene"] if options["scenes"] else []
        every = every_option().items()
        given += [one.flag for name, (one, _) in every if options[name] is not None]
        if given:
            raise ValueError(
                f"{', '.join(given)} with --task; accepted: one or the other, or the number as an "
                "--axis NAME=VALUE"
            )
        named = [task_by_name(one) for one in tasks]
        if others := [one.name for one in named if one.machine != machine.name]:
            raise ValueError(f"--task {others[0]}; accepted: tasks of the {machine.title}")
        _require_own(who, machine)
        _, found = cases_on([one.name for one in named], list(who))
        return found, "\n".join(f"{one.name}: {one.title}" for one in named)
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
    _require_own(names, machine)
    read = read_named(names, machine)
    return {name: controller_of(read[name], name, env, params, machine) for name in read}


def _require_own(names: Sequence[str], machine: AnyMachine) -> None:
    """Raise ValueError for a name given twice, and for baselines of another machine."""
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


def _checked_player(given: Given, env: AnyEnv) -> Controller[PyTree, PyTree, PyTree]:
    player, name = given.player, given.policy
    if isinstance(player, Planner) and not isinstance(player, Controller):
        raise ValueError(
            f"{name} plans each episode before it begins; accepted: policies and controllers, "
            "whose episodes are vmapped"
        )
    if isinstance(player, MLPPolicy):
        seen, made = len(env.observation_bounds(given.params)[0]), player.layer_sizes
        if made[0] != seen or made[-1] != len(env.action_names):
            raise ValueError(
                f"{name} observes {made[0]} numbers and gives {made[-1]}, {given.task} has {seen} "
                f"and takes {len(env.action_names)}; accepted: a policy trained on what the task "
                "observes"
            )
    return player.validate()


def _require_disjoint(fields: Mapping[str, Sequence[str]]) -> None:
    """Raise ValueError where two axes set one field."""
    owner: dict[str, str] = {}
    for name, targets in fields.items():
        for one in targets:
            if one in owner:
                raise ValueError(
                    f"axes {owner[one]} and {name} both set {one}; accepted: one of them"
                )
            owner[one] = name


def _corners(design: Design) -> list[dict[str, float]]:
    """Values at the corners of the axes' box, or at either end of each axis where it has many."""
    ends = {name: dict.fromkeys(axis.ends) for name, axis in design.axes.items()}
    if len(ends) <= MOST_CORNERS:
        corners = itertools.product(*ends.values())
        return [dict(zip(ends, one, strict=True)) for one in corners] if ends else []
    first = {name: next(iter(values)) for name, values in ends.items()}
    return [first] + [first | {name: one} for name in ends for one in list(ends[name])[1:]]
