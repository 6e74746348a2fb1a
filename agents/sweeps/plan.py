"""The plan of a sweep: the grid of its axes, cases (a policy on a task), and cells of episodes.

A cell is one file and one call of a vmapped program. All cells of a case have one size, the last
one padded, so that a case is one program, and results depend on nothing but the cells' size.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import jax
import numpy as np
from jax.core import Tracer

from stickslip.agents.evaluation.rollout import STEP_BYTES, episode_key, rollout
from stickslip.agents.sweeps.cases import digest_of
from stickslip.dynamics import checks
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from jaxtyping import PyTree

    from stickslip.agents.machine import Machine
    from stickslip.agents.sweeps.cases import Axes, Case
    from stickslip.agents.sweeps.swept import Swept

RANGE = re.compile(r"([^:]+):([^:]+):(\d{1,6})(:log)?")
FORMS = "LOW:HIGH:N (even), LOW:HIGH:N:log, or values as 0.1,0.2,0.5"

AxisLike: TypeAlias = "str | float | Iterable[float]"
"""Accepted forms of an axis: its text, one value or several."""


def axis_values(given: AxisLike) -> tuple[float, ...]:
    """The values of an axis from a text (see FORMS), a number or several. ValueError otherwise."""
    if isinstance(given, str) and ":" in given:
        return _range(given)
    if isinstance(given, str):
        given = [_number(one, given) for one in given.split(",")]
    values = np.atleast_1d(np.asarray(list(given) if isinstance(given, Iterable) else given))
    checks.require_number("values", values, accepted="finite numbers, at least one")
    if len(set(values.tolist())) < values.size:
        raise ValueError(f"values = {checks.shown(values.tolist())}; accepted: each value once")
    return tuple(map(float, values))


def _range(text: str) -> tuple[float, ...]:
    found = RANGE.fullmatch(text)
    if found is None:
        raise ValueError(f"{checks.shown(text)} is no axis; accepted: {FORMS}")
    low, high, log = _number(found[1], text), _number(found[2], text), bool(found[4])
    count = int(found[3])
    if not -math.inf < low < high < math.inf or (log and low <= 0) or count < 2:
        raise ValueError(
            f"{checks.shown(text)}; accepted: finite LOW < HIGH, LOW > 0 with log, 2 values or more"
        )
    return tuple((np.geomspace if log else np.linspace)(low, high, count).tolist())


def _number(text: str, whole: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(
            f"{checks.shown(text)} in {checks.shown(whole)} is no number; accepted: {FORMS}"
        ) from None


def axes_of(given: Mapping[str, AxisLike]) -> Axes:
    """Values of axes by name. ValueError naming the axis."""
    checks.require_kind(
        "axes", given, Mapping, 'a dict of axes by name, {"mu": "0.02:0.3:64"} or such'
    )
    found = {}
    for name, values in given.items():
        try:
            found[str(name)] = axis_values(values)
        except ValueError as error:
            raise ValueError(f"axis {name}: {error}") from error
    return found


def values_at(axes: Axes, points: np.ndarray) -> dict[str, np.ndarray]:
    """The axes' values at points by their flat indices, the last axis fastest, in float64."""
    places = np.unravel_index(points, tuple(map(len, axes.values())) or (1,))
    pairs = zip(axes.items(), places, strict=False)
    return {name: np.asarray(values)[place] for (name, values), place in pairs}


MOST_EPISODES = 2**20
"""Episodes of a point."""
CPU_CELL, GPU_CELL = 2048, 65536
"""Episodes of a cell; on a CPU more side by side are hardly faster."""
ENDINGS = tuple(one.name.lower() for one in Status)
"""Ending of an episode by the number of its last status."""


class Cell(NamedTuple):
    """Episodes first to last - 1 of a case, point by point, seed by seed."""

    case: int
    first: int
    last: int


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
        checks.require_memory(f"steps = {steps}", "steps of an episode", steps, STEP_BYTES)
        return cls(machine, tuple(cases), axes, episodes)

    def cut(self, cell: int | None, threads: int) -> Plan:
        """Choose the cells' size, for the memory at hand where None is given."""
        each = max(one.steps for one in self.cases) * STEP_BYTES
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

    def at(self, number: int) -> Cell:
        """A cell by its number: case by case."""
        case, place = divmod(number, -(-self.of_case // self.cell))
        first = place * self.cell
        return Cell(case, first, min(first + self.cell, self.of_case))

    @cached_property
    def definition(self) -> dict[str, object]:
        """Definition that decides the results, as JSON values that sweeps are resumed by."""
        axes = {name: {"kind": "grid", "values": list(one)} for name, one in self.axes.items()}
        return {
            "machine": self.machine.name,
            "tasks": {one.task: digest_of(one.params, one.steps) for one in self.cases},
            "policies": {one.policy: digest_of(one.player, one.env) for one in self.cases},
            "cases": [[one.task, one.policy] for one in self.cases],
            "axes": axes,
            "samples": 0,
            "design_seed": 0,
            "sets": {name: list(fields) for name, fields in self.cases[0].fields.items()},
            "episodes": self.episodes,
        }

    @cached_property
    def units(self) -> dict[str, str]:
        """Units of the axes and of the columns kept of an episode."""
        swept, measures = self.machine.swept(), self.machine.measures(self.cases[0].env)
        axes = {name: swept.unit(one[0]) for name, one in self.cases[0].fields.items()}
        return axes | dict(measures.kept)


class Player:
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
        cell, plan = self._plan.at(number), self._plan
        case = plan.cases[cell.case]
        episodes = np.minimum(np.arange(cell.first, cell.first + plan.cell), plan.of_case - 1)
        points, seeds = np.divmod(episodes, plan.episodes)
        count = min(plan.points, (plan.cell - 2) // plan.episodes + 2)
        values = values_at(plan.axes, np.minimum(points[0] + np.arange(count), plan.points - 1))
        fields = {field: values[name] for name in values for field in case.fields[name]}
        play = jax.jit(partial(play_cell, self._swept, self._measures.keep, case))
        program = self._programs.setdefault(case.program, play)
        devices = jax.local_devices()
        with jax.default_device(devices[number % len(devices)]):
            index = (points - points[0]).astype(np.int32), seeds.astype(np.uint32)
            given = jax.device_put((case.player, fields, *index))
            found = jax.tree.map(np.asarray, program(*given))
        columns = {name: getattr(found, name) for name in self._measures.kept}
        columns["fell"] = np.asarray(found.fell, bool)
        if hasattr(found, "status"):
            columns["ending"] = np.asarray(found.status, np.int8)
        return {name: one[: cell.last - cell.first] for name, one in columns.items()}


def play_cell(
    swept: Swept,
    keep: Callable[[PyTree, PyTree], PyTree],
    case: Case,
    player: PyTree,
    values: Mapping[str, PyTree],
    place: PyTree,
    seeds: PyTree,
) -> PyTree:
    """Play episodes side by side and keep what is asked for; pure.

    values: of the fields that axes set, each [points]; place: each episode's index into them.
    Parameters that no axis sets are constants; those that depend on an axis are computed once for
    each point. Seed s draws as the first episode after reset(seed=s), the same at every point.
    """
    found: list[PyTree] = []

    def at(point: Mapping[str, PyTree]) -> dict[int, PyTree]:
        leaves, structure = jax.tree.flatten(swept.put(case.params, point))
        found.append((leaves, structure))
        return {i: leaf for i, leaf in enumerate(leaves) if isinstance(leaf, Tracer)}

    varied = jax.vmap(at)(values) if values else at({})
    leaves, structure = found[-1]
    here = jax.tree.map(lambda leaf: leaf[place], varied)

    def one(own: dict[int, PyTree], seed: PyTree) -> PyTree:
        mine = jax.tree.unflatten(structure, [own.get(i, leaf) for i, leaf in enumerate(leaves)])
        return keep(rollout(case.env, player, mine, episode_key(seed), case.steps), mine)

    return jax.vmap(one)(here, seeds)
