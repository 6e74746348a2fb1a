"""Policies on tasks as a user names them, checked before anything is compiled."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import jax
import numpy as np

from stickslip.agents.evaluation.players import given_flags, places_of, read_named, require_observed
from stickslip.agents.evaluation.rollout import horizon, is_random, validated, without_resets
from stickslip.agents.machine import Machine, machine_by_name, machine_of_env
from stickslip.agents.protocol import Controller
from stickslip.dynamics.checks import require_kind, shown
from stickslip.envs.functional import FunctionalEnv
from stickslip.envs.tasks.definition import task_by_name

if TYPE_CHECKING:
    from jaxtyping import PyTree

    from stickslip.agents.protocol import AnyEnv, Options, Player, Timed

    Axes: TypeAlias = Mapping[str, tuple[float, ...]]
    Pair: TypeAlias = tuple[AnyEnv, Timed]
    Tasks: TypeAlias = str | Pair | Sequence[str] | Mapping[str, Pair]
    """A named task, or an environment and its parameters, or several."""
    Policies: TypeAlias = str | Sequence[str] | Mapping[str, Player]
    """Names of baselines and policy files, or controllers by names of one's own."""

MOST_CORNERS = 64
"""Corners of the box of the axes that are checked."""


def cases_on(task: Tasks, policies: Policies, axes: Axes) -> tuple[Machine, list[Case]]:
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
        for name, player in _players(policies, env, params, machine).items():
            found.append(Case.of(machine, axes, label, name, env, params, player))
    return machine, found


def cases_named(
    machine: Machine,
    who: Sequence[str],
    options: Options,
    tasks: Sequence[str] | None,
    axes: Axes,
) -> tuple[list[Case], str]:
    """The cases of a command line and a description: on named tasks, or on the policies' own task
    changed by options. ValueError where policies have several tasks of their own."""
    if tasks:
        if given := given_flags(options):
            raise ValueError(f"{', '.join(given)} with --task; accepted: one of them, or an --axis")
        named = [task_by_name(one) for one in tasks]
        if others := [one.name for one in named if one.machine != machine.name]:
            raise ValueError(f"--task {others[0]}; accepted: tasks of the {machine.title}")
        _, found = cases_on([one.name for one in named], list(who), axes)
        return found, "\n".join(f"{one.name}: {one.title}" for one in named)
    named = read_named(who, machine)
    places = places_of(named, options)
    if len(places) > 1:
        labels = "; ".join(place.label for place in places)
        raise ValueError(
            f"{len(places)} tasks: {labels}; accepted: policies of one task, or --task NAME for all"
        )
    (place,), found = places, []
    for name, env in place.who.items():
        player = named[name].player(env, place.params)
        found.append(Case.of(machine, axes, place.label, name, env, place.params, player))
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


def _players(policies: Policies, env: AnyEnv, params: Timed, machine: Machine) -> dict[str, Player]:
    if isinstance(policies, Mapping):
        return {str(name): one for name, one in policies.items()}
    require_kind("policies", policies, (str, Sequence), "names, or controllers by name in a dict")
    read = read_named([policies] if isinstance(policies, str) else policies, machine)
    return {name: one.player(env, params) for name, one in read.items()}


@dataclass(frozen=True)
class Case:
    """A checked policy on a task.

    fields: axis -> dotted fields that it sets. steps: control steps of the longest episode.
    random: whether a reset draws anything that no axis sets.
    """

    task: str
    policy: str
    env: PyTree
    params: PyTree
    player: PyTree
    fields: dict[str, tuple[str, ...]]
    steps: int
    random: bool

    @cached_property
    def program(self) -> str:
        """Digest of all that is compiled but the player."""
        return digest_of(self.env, self.params, sorted(self.fields.items()), self.steps)

    @classmethod
    def of(
        cls,
        machine: Machine,
        axes: Axes,
        task: str,
        policy: str,
        env: AnyEnv,
        params: Timed,
        player: Player,
    ) -> Case:
        """Check a case before anything is compiled.

        ValueError naming the axis or the policy for unknown fields, values out of the task's range,
        a policy that does not fit and planners.
        """
        swept = machine.swept()
        env = without_resets(env)
        player = validated(policy, player, Controller)
        require_observed(player, policy, env, params, task)
        opened = swept.opened(params, axes)
        fields = {name: swept.targets(opened, name) for name in axes}
        twice = list(itertools.chain(*fields.values()))
        if common := {one for one in twice if twice.count(one) > 1}:
            names = " and ".join(name for name in fields if common & set(fields[name]))
            raise ValueError(f"axes {names} both set {common.pop()}; accepted: one of them")
        corners = [opened, *(swept.changed(params, values) for values in _corners(axes))]
        steps = max(horizon(one) for one in corners)
        return cls(task, policy, env, opened, player, fields, steps, is_random(corners[-1]))


def _corners(axes: Axes) -> list[dict[str, float]]:
    """Values at corners of the axes' box, the one opposite to the first among them."""
    ends = [dict.fromkeys((min(values), max(values))) for values in axes.values()]
    corners = list(itertools.islice(itertools.product(*ends), MOST_CORNERS))
    corners.append(tuple(list(one)[-1] for one in ends))
    return [dict(zip(axes, one, strict=True)) for one in dict.fromkeys(corners) if one]


def digest_of(*parts: object) -> str:
    """Digest of static things by their repr and of pytrees by structure and numbers."""
    found = hashlib.sha256()
    for part in parts:
        leaves, structure = jax.tree.flatten(part)
        found.update(repr(structure).encode())
        for leaf in leaves:
            if isinstance(leaf, jax.Array | np.ndarray | np.generic | float | int):
                array = np.asarray(leaf)
                found.update(f"{array.dtype} {array.shape}".encode())
                found.update(array.tobytes())
            else:
                found.update(repr(leaf).encode())
    return found.hexdigest()
