"""The plan of a sweep: cases, points and episodes, cut into cells that are played one by one."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import jax
import numpy as np

from stickslip.agents.evaluation.evaluate import A_STEP
from stickslip.agents.optimum.solution import digest_of
from stickslip.agents.sweeps.cases import Case
from stickslip.agents.sweeps.store import digest_of_text
from stickslip.dynamics.checks import memory_limit, require_integer, require_memory

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from stickslip.agents.machine import AnyMachine
    from stickslip.agents.sweeps.axes import Design
    from stickslip.agents.sweeps.cases import Given
    from stickslip.agents.sweeps.store import Head

MOST_EPISODES = 2**20
"""Of a point."""
CPU_TILE, GPU_TILE = 1024, 65536
"""Episodes vmapped together; on a CPU more are no faster."""
CELL = 65536
"""Episodes of a cell: some ten seconds of a core."""
A_ROW = 400
"""Bytes of an episode's row while a cell is assembled, all copies counted."""
CELLS_A_THREAD = 4
"""At least, so that no thread idles for long at the end."""


class Layout(NamedTuple):
    """Sizes of tiles and cells. Results do not depend on cells; tiles decide which episodes are
    neighbours in a program. cell_points: a multiple of tile_points."""

    tile_points: int
    tile_seeds: int
    cell_points: int


UNCUT = Layout(1, 1, 1)


class Cell(NamedTuple):
    """All episodes of points first to last - 1 of a case. number: its place among all cells."""

    number: int
    case: int
    first: int
    last: int


class Tile(NamedTuple):
    """Episodes that are vmapped together. values: of the fields that axes set, by dotted names,
    each [points]; place: the point of each episode [episodes]; seeds: [episodes]."""

    values: dict[str, np.ndarray]
    place: np.ndarray
    seeds: np.ndarray


@dataclass(frozen=True)
class Plan:
    """A whole sweep. episodes: of each point, of seeds 0, 1, ..."""

    machine: AnyMachine
    cases: tuple[Case, ...]
    design: Design
    episodes: int
    layout: Layout = UNCUT

    @classmethod
    def of(cls, machine: AnyMachine, given: Sequence[Given], design: Design, episodes: int) -> Plan:
        """Check a plan, not cut yet. ValueError for what cannot be played."""
        require_integer("episodes", episodes, high=MOST_EPISODES)
        cases = tuple(Case.of(machine, one, design) for one in given)
        pairs = [(one.task, one.policy) for one in cases]
        if not pairs:
            raise ValueError("no policy, or no task; accepted: at least one of each")
        if twice := next((one for one in pairs if pairs.count(one) > 1), None):
            raise ValueError(f"{twice[1]} on {twice[0]} is given twice; accepted: once")
        if not any(one.random for one in cases):
            episodes = 1  # all would be the same
        return cls(machine, cases, design, episodes)

    def cut(self, cell: int | None, threads: int, tile: int | None = None) -> Plan:
        """Choose tiles and cells for the memory at hand. cell, tile: their episodes at most."""
        steps = max(one.steps for one in self.cases)
        require_memory(f"steps = {steps}", "steps of an episode", steps, A_STEP)
        memory = _free_memory(memory_limit()) / (2 * threads)
        most = CPU_TILE if jax.default_backend() == "cpu" else GPU_TILE
        most = most if tile is None else require_integer("tile", tile, high=2**24)
        tile = max(1, min(most, int(memory // (A_STEP * steps))))
        if self.episodes <= tile:
            points, seeds = min(tile // self.episodes, self.design.points), self.episodes
        else:
            points, seeds = 1, -(-self.episodes // -(-self.episodes // tile))
        if cell is None:
            tiles = -(-self.design.points // points) * len(self.cases)
            wanted = -(-tiles // (CELLS_A_THREAD * threads)) * points * self.episodes
            wanted = int(min(wanted, max(CELL, tile), memory // A_ROW))
        else:
            wanted = require_integer("cell", cell, high=2**31)
            require_memory(f"cell = {cell}", "episodes in memory", wanted, threads * A_ROW)
        count = max(1, -(-wanted // (points * self.episodes)))
        return replace(self, layout=Layout(points, seeds, count * points))

    def layout_from(self, head: Head, path: Path) -> Layout:
        """The layout that a sweep was begun with. ValueError where it does not fit the plan."""
        try:
            layout = Layout(*(int(head["layout"][name]) for name in Layout._fields))
            points, seeds = self.design.points, self.episodes
            cells = len(self.cases) * -(-points // max(1, layout.cell_points))
            fits = 0 < layout.tile_points <= points and 0 < layout.tile_seeds <= seeds
            if not fits or layout.cell_points < 1 or cells != head["cells"]:
                raise ValueError(f"{layout} with {head['cells']} cells")
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(
                f"{path / 'sweep.json'}: its layout is damaged ({error}); accepted: the file as it "
                "was written"
            ) from error
        return layout

    @cached_property
    def cells(self) -> tuple[Cell, ...]:
        """All cells in their order: case by case, point after point."""
        size, points = self.layout.cell_points, self.design.points
        places = [(case, at) for case in range(len(self.cases)) for at in range(0, points, size)]
        return tuple(
            Cell(number, case, first, min(first + size, points))
            for number, (case, first) in enumerate(places)
        )

    @property
    def total(self) -> int:
        """Episodes of all cases."""
        return len(self.cases) * self.design.points * self.episodes

    def size(self, number: int) -> int:
        """Episodes of a cell."""
        cell = self.cells[number]
        return (cell.last - cell.first) * self.episodes

    def tiles(self, cell: Cell) -> Iterator[tuple[Tile, int]]:
        """A cell's tiles, all padded to one size, and how many episodes of each are real."""
        case, (points, seeds, _) = self.cases[cell.case], self.layout
        for first in range(cell.first, cell.last, points):
            last = min(first + points, cell.last)
            here = self.design.at(first, last)
            values = {
                field: _padded(here[name], points) for name in here for field in case.fields[name]
            }
            for begin in range(0, self.episodes, seeds):
                which = np.arange(begin, min(begin + seeds, self.episodes), dtype=np.uint32)
                place = np.repeat(np.arange(last - first, dtype=np.int32), len(which))
                own, size = np.tile(which, last - first), points * seeds
                yield Tile(values, _padded(place, size), _padded(own, size)), len(own)

    @cached_property
    def definition(self) -> dict[str, object]:
        """Definition that decides the results, as JSON values."""
        axes = self.cases[0].fields
        return {
            "machine": self.machine.name,
            "tasks": {one.task: digest_of(one.params, one.steps) for one in self.cases},
            "policies": {one.policy: digest_of(one.player, one.env) for one in self.cases},
            "cases": [[one.task, one.policy] for one in self.cases],
            **self.design.describe(),
            "sets": {name: list(fields) for name, fields in axes.items()},
            "episodes": self.episodes,
        }

    @cached_property
    def digest(self) -> str:
        """Digest of the definition."""
        return digest_of_text(json.dumps(self.definition, sort_keys=True, allow_nan=False))

    @cached_property
    def units(self) -> dict[str, str]:
        """Units of the axes and of the columns kept of an episode."""
        swept = self.machine.swept()
        axes = {name: swept.unit(one[0]) for name, one in self.cases[0].fields.items()}
        return axes | dict(swept.kept_units(self.cases[0].env))

    def about(self) -> dict[str, object]:
        """Entries of sweep.json beside the definition."""
        random = [one.task for one in self.cases if one.random]
        return {
            "layout": self.layout._asdict(),
            "episodes": self.total,
            "units": self.units,
            "random": list(dict.fromkeys(random)),
        }


def _padded(values: np.ndarray, count: int) -> np.ndarray:
    """Repeat the last entry until there are `count`."""
    return np.concatenate([values, np.repeat(values[-1:], count - len(values))])


def _free_memory(limit: float) -> float:
    """Bytes that may be used now: half of what the device or machine has free, at most `limit`."""
    stats = jax.devices()[0].memory_stats() if jax.default_backend() != "cpu" else None
    if stats and "bytes_limit" in stats:
        free = float(stats["bytes_limit"] - stats.get("bytes_in_use", 0))
    else:
        try:
            free = float(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
        except (ValueError, OSError, AttributeError):
            free = limit
    return min(limit, max(free / 2, 2.0**26))
