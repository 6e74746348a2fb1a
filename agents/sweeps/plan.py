"""The plan of a sweep: cases (a policy on a task, checked before compiling), its grid and cells.

A cell is one file and one call of a vmapped program. All cells of a case have one size, the last
one padded, so that a case is one program, and results depend on nothing but the cells' size.
"""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, TypeAlias

import jax
import numpy as np
from jax.core import Tracer

from stickslip.agents.evaluation import rollout
from stickslip.agents.evaluation.players import given_flags, places_of, read_named, require_observed
from stickslip.agents.machine import Machine, machine_by_name, machine_of_env
from stickslip.agents.protocol import Controller, Options, Player
from stickslip.agents.sweeps.swept import values_at
from stickslip.dynamics import checks
from stickslip.dynamics.status import Status
from stickslip.envs.functional import AnyEnv, FunctionalEnv, Timed
from stickslip.envs.tasks.definition import task_by_name

if TYPE_CHECKING:
    from jaxtyping import PyTree

Axes: TypeAlias = Mapping[str, tuple[float, ...]]
Pair: TypeAlias = tuple[AnyEnv, Timed]
Tasks: TypeAlias = str | Pair | Sequence[str] | Mapping[str, Pair]
"""A named task, or an environment and its parameters, or several."""
Policies: TypeAlias = str | Sequence[str] | Mapping[str, Player]
"""Names of baselines and policy files, or controllers by names of one's own."""
FEW, TOGETHER = 6, 3
"""Axes of which all corners are checked; of more axes, how many that change together."""


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
            found.append(Case.of(machine, axes, (label, env, params), name, player))
    return machine, found


def cases_named(
    machine: Machine, who: Sequence[str], options: Options, tasks: Sequence[str] | None, axes: Axes
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
        found.append(Case.of(machine, axes, (place.label, env, place.params), name, player))
    return found, place.line()


def _tasks(task: Any) -> dict[str, Pair]:
    if isinstance(task, str):
        task = [task]
    if isinstance(task, tuple) and len(task) == 2 and isinstance(task[0], FunctionalEnv):
        return {"own": task}
    if isinstance(task, Mapping):
        return {str(label): pair for label, pair in task.items()}
    checks.require_kind("task", task, Sequence, "a name, (env, params), or several")
    return {one.name: one.make() for one in map(task_by_name, task)}


def _players(policies: Policies, env: AnyEnv, params: Timed, machine: Machine) -> dict[str, Player]:
    if isinstance(policies, Mapping):
        return {str(name): one for name, one in policies.items()}
    accepted = "names, or controllers by name in a dict"
    checks.require_kind("policies", policies, (str, Sequence), accepted)
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

    @classmethod
    def of(
        cls,
        machine: Machine,
        axes: Axes,
        at: tuple[str, AnyEnv, Timed],
        policy: str,
        player: Player,
    ) -> Case:
        """Check a case before anything is compiled. at: the task, its environment and parameters.

        ValueError naming the axis or the policy for unknown fields, values out of the task's range,
        a policy that does not fit and planners.
        """
        swept, (task, env, params) = machine.swept(), at
        env = rollout.without_resets(env)
        player = rollout.validated(policy, player, Controller)
        require_observed(player, policy, env, params, task)
        rollout.require_fitting(env, player, params)
        opened = swept.opened(params, axes)
        fields = {name: swept.targets(opened, name) for name in axes}
        twice = list(itertools.chain(*fields.values()))
        if common := {one for one in twice if twice.count(one) > 1}:
            names = " and ".join(name for name in fields if common & set(fields[name]))
            raise ValueError(f"axes {names} both set {common.pop()}; accepted: one of them")
        corners = [opened, *(swept.changed(params, values) for values in _corners(axes))]
        steps = max(rollout.horizon(one) for one in corners)
        is_random = rollout.is_random(env, corners[-1])
        return cls(task, policy, env, opened, player, fields, steps, is_random)


def _corners(axes: Axes) -> Iterator[dict[str, float]]:
    """Values at corners of the axes' box: all of them for few axes; else those where any TOGETHER
    axes are at any ends and the others at their least values, and the one opposite to the first."""
    low, high = ({name: of(values) for name, values in axes.items()} for of in (min, max))
    varied = [name for name in axes if low[name] < high[name]]
    most = len(varied) if len(varied) <= FEW else TOGETHER
    for count in range(most + 1 if axes else 0):
        for some in itertools.combinations(varied, count):
            yield low | {name: high[name] for name in some}
    if len(varied) > FEW:
        yield high


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
                found.update(_in_full(leaf).encode())
    return found.hexdigest()


def _in_full(leaf: object) -> str:
    """The repr, and the fields of a dataclass that it leaves out where they are not as usual."""
    own = fields(leaf) if is_dataclass(leaf) else ()
    left_out = [(one.name, getattr(leaf, one.name), one.default) for one in own if not one.repr]
    unusual = [(name, value) for name, value, usual in left_out if value != usual]
    return f"{leaf!r}{unusual or ''}"


MOST_EPISODES = 2**20
"""Episodes of a point."""
CPU_CELL, GPU_CELL = 2048, 65536
"""Episodes of a cell; on a CPU more side by side are hardly faster."""
ENDINGS = tuple(one.name.lower() for one in Status)
"""Ending of an episode by the number of its last status."""


@dataclass(frozen=True)
class Plan:
    """A whole sweep. episodes: of each point, of seeds 0, 1, ...; cell: episodes of a cell."""

    machine: Machine
    cases: tuple[Case, ...]
    axes: Axes
    episodes: int
    cell: int = 0

    @classmethod
    def of(cls, machine: Machine, cases: Sequence[Case], axes: Axes, episodes: int) -> Plan:
        """Check a plan, not cut yet. ValueError for what cannot be played."""
        checks.require_integer("episodes", episodes, high=MOST_EPISODES)
        if not cases:
            raise ValueError("no policy, or no task; accepted: at least one of each")
        if not any(one.random for one in cases):
            episodes = 1  # all would be the same
        steps = max(one.steps for one in cases)
        checks.require_memory(f"steps = {steps}", "steps of an episode", steps, rollout.STEP_BYTES)
        return cls(machine, tuple(cases), axes, episodes)

    def cut(self, cell: int | None, threads: int) -> Plan:
        """Choose the cells' size, for the memory at hand where None is given."""
        each = max(one.steps for one in self.cases) * rollout.STEP_BYTES
        if cell is not None:
            count = checks.require_integer("cell", cell)
            checks.require_memory(f"cell = {cell}", "episodes", count, each)
            return replace(self, cell=min(cell, self.of_case))
        most = CPU_CELL if jax.default_backend() == "cpu" else GPU_CELL
        most = max(1, min(most, int(checks.memory_limit() / (2 * threads * each))))
        return replace(self, cell=-(-self.of_case // -(-self.of_case // most)))

    @property
    def points(self) -> int:
        """Points of the grid; 1 without axes."""
        return math.prod(map(len, self.axes.values()))

    @property
    def of_case(self) -> int:
        """Episodes of a case."""
        return self.points * self.episodes

    @property
    def total(self) -> int:
        """Episodes of all cases."""
        return len(self.cases) * self.of_case

    @property
    def cells(self) -> int:
        """Number of cells."""
        return len(self.cases) * -(-self.of_case // self.cell)

    def at(self, number: int) -> tuple[Case, int, int]:
        """A cell by its number: episodes first to last - 1 of a case by point and seed."""
        case, place = divmod(number, -(-self.of_case // self.cell))
        first = place * self.cell
        return self.cases[case], first, min(first + self.cell, self.of_case)

    @cached_property
    def definition(self) -> dict[str, object]:
        """Definition that decides the results, as JSON values that sweeps are resumed by."""
        axes = {name: {"values": list(one)} for name, one in self.axes.items()}
        return {
            "machine": self.machine.name,
            "tasks": {one.task: digest_of(one.env, one.params, one.steps) for one in self.cases},
            "policies": [digest_of(one.player) for one in self.cases],
            "cases": [[one.task, one.policy] for one in self.cases],
            "axes": axes,
            "sets": {name: list(fields) for name, fields in self.cases[0].fields.items()},
            "episodes": self.episodes,
        }

    @cached_property
    def units(self) -> dict[str, str]:
        """Units of the axes and of the columns kept of an episode."""
        swept, measures = self.machine.swept(), self.machine.measures(self.cases[0].env)
        axes = {name: swept.unit(one[0]) for name, one in self.cases[0].fields.items()}
        return axes | dict(measures.kept)


class CellPlayer:
    """Plays cells of a plan, by their numbers, on the devices in turn. Threads may share it.

    A program is not partitioned over devices: a partitioned one rounds differently, and results
    would depend on the number of devices.
    """

    def __init__(self, plan: Plan):
        self._plan, self._swept = plan, plan.machine.swept()
        self._measures = plan.machine.measures(plan.cases[0].env)
        self._programs: dict[str, Callable[..., PyTree]] = {}

    def __call__(self, number: int) -> dict[str, np.ndarray]:
        """Columns of a cell's episodes."""
        plan = self._plan
        case, first, last = plan.at(number)
        episodes = np.minimum(np.arange(first, first + plan.cell), plan.of_case - 1)
        points, seeds = np.divmod(episodes, plan.episodes)
        count = min(plan.points, (plan.cell - 2) // plan.episodes + 2)
        values = values_at(plan.axes, np.minimum(points[0] + np.arange(count), plan.points - 1))
        fields = {field: values[name] for name in values for field in case.fields[name]}
        play = jax.jit(partial(self._play, case))
        program = self._programs.setdefault(case.task, play)  # whoever plays
        devices = jax.local_devices()
        with jax.default_device(devices[number % len(devices)]):
            index = (points - points[0]).astype(np.int32), seeds.astype(np.uint32)
            given = jax.device_put((case.player, fields, *index))
            found = jax.tree.map(np.asarray, program(*given))
        columns = {name: getattr(found, name) for name in self._measures.kept}
        columns["fell"] = np.asarray(found.fell, bool)
        if hasattr(found, "status"):
            columns["ending"] = np.asarray(found.status, np.int8)
        return {name: one[: last - first] for name, one in columns.items()}

    def _play(
        self, case: Case, player: PyTree, values: Any, place: PyTree, seeds: PyTree
    ) -> PyTree:
        """Play episodes side by side and keep what is asked for; pure.

        values: of the fields that axes set, each [points]; place: each episode's index into them.
        Parameters that no axis sets are constants; those that depend on an axis are computed once
        for each point. Seed s draws what the first episode after reset(seed=s) does.
        """
        found: list[PyTree] = []

        def at(point: Mapping[str, PyTree]) -> dict[int, PyTree]:
            leaves, structure = jax.tree.flatten(self._swept.put(case.params, point))
            found.append((leaves, structure))
            return {i: leaf for i, leaf in enumerate(leaves) if isinstance(leaf, Tracer)}

        varied = jax.vmap(at)(values) if values else at({})
        leaves, structure = found[-1]
        here = jax.tree.map(lambda leaf: leaf[place], varied)

        def one(own: dict[int, PyTree], seed: PyTree) -> PyTree:
            every = [own.get(i, leaf) for i, leaf in enumerate(leaves)]
            mine, key = jax.tree.unflatten(structure, every), rollout.episode_key(seed)
            episode = rollout.rollout(case.env, player, mine, key, case.steps)
            return self._measures.keep(episode, mine)

        return jax.vmap(one)(here, seeds)
