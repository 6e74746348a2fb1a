"""What a sweep is: its cases and points, which episodes, in which tiles and chunks."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import jax
import numpy as np

from stickslip.agents.evaluation.run import A_STEP
from stickslip.agents.optimum.checkpoint import digest_of
from stickslip.agents.sweeps.playing.case import Case, case_of, marks_of
from stickslip.agents.sweeps.playing.program import Tile, memory_at_hand
from stickslip.dynamics.checks import memory_limit, require_integer, require_memory

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from stickslip.agents.machine import AnyMachine
    from stickslip.agents.sweeps.definition import Definition
    from stickslip.agents.sweeps.design import Design
    from stickslip.agents.sweeps.playing.case import Played

MOST_EPISODES = 2**20
"""At a point."""
A_TILE = {"cpu": 1024}
"""Episodes side by side in a program; on a processor more are no quicker."""
OTHER_TILE = 65536
A_CHUNK = 65536
"""Episodes of a chunk, or as many tiles as hold them: some ten seconds of a core."""
A_ROW = 400
"""Bytes that an episode's row takes while a chunk is put together, in all its copies."""
CHUNKS_A_THREAD = 4
"""At least, so that no thread is idle for long at the end."""


class Layout(NamedTuple):
    """How a sweep is cut. No result depends on chunks; tiles decide which episodes are neighbours.

    tile_points, tile_seeds: of a tile. chunk_points: a multiple of tile_points.
    """

    tile_points: int
    tile_seeds: int
    chunk_points: int


UNCUT = Layout(1, 1, 1)


class Chunk(NamedTuple):
    """Points first to last - 1 of a case, all their episodes. number: its place among all."""

    number: int
    case: int
    first: int
    last: int


@dataclass(frozen=True)
class Plan:
    """All of a sweep. episodes: of each point, seeds 0, 1, ... independent: whether points draw
    apart. summaries: whether a point is written as one row. `stickslip.agents.sweep` makes it."""

    machine: AnyMachine
    cases: tuple[Case, ...]
    design: Design
    episodes: int
    independent: bool
    summaries: bool
    layout: Layout = UNCUT

    @classmethod
    def of(
        cls,
        machine: AnyMachine,
        played: Sequence[Played],
        design: Design,
        *,
        episodes: int,
        independent: bool,
        summaries: bool,
    ) -> Plan:
        """A plan that is not cut yet. ValueError for what cannot be played."""
        require_integer("episodes", episodes, high=MOST_EPISODES)
        cases = tuple(case_of(machine, one, design) for one in played)
        if not any(one.draws for one in cases):
            episodes = 1  # all would be the same
        pairs = [(one.task, one.policy) for one in cases]
        if not pairs:
            raise ValueError("no policy, or no task; accepted: at least one of each")
        if twice := next((one for one in pairs if pairs.count(one) > 1), None):
            raise ValueError(f"{twice[1]} on {twice[0]} is given twice; accepted: once")
        return cls(machine, cases, design, episodes, independent, summaries)

    def cut(self, chunk: int | None, threads: int, tile: int | None = None) -> Plan:
        """With tiles and chunks for the memory at hand. chunk: episodes, rounded up to tiles; tile:
        the most episodes of one."""
        memory = memory_at_hand(memory_limit()) / (2 * threads)
        each = A_STEP * max(one.steps for one in self.cases)
        require_memory(f"steps = {each // A_STEP}", "steps of an episode", each // A_STEP, A_STEP)
        most = A_TILE.get(jax.default_backend(), OTHER_TILE)
        most = most if tile is None else require_integer("tile", tile, high=2**24)
        tile = max(1, min(most, int(memory // each)))
        if self.episodes <= tile:
            points, seeds = min(tile // self.episodes, self.design.points), self.episodes
        else:
            points, seeds = 1, -(-self.episodes // -(-self.episodes // tile))
        if chunk is None:
            tiles = -(-self.design.points // points) * len(self.cases)
            wanted = -(-tiles // (CHUNKS_A_THREAD * threads)) * points * self.episodes
            wanted = min(wanted, max(A_CHUNK, tile), memory // A_ROW)
        else:
            wanted = require_integer("chunk", chunk, high=2**31)
            given = f"chunk = {chunk}"
            require_memory(given, "episodes in memory", wanted, threads * A_ROW)
        count = max(1, -(-int(wanted) // (points * self.episodes)))
        return replace(self, layout=Layout(points, seeds, count * points))

    @cached_property
    def chunks(self) -> tuple[Chunk, ...]:
        """All chunks in their order: case by case, point after point."""
        size, points = self.layout.chunk_points, self.design.points
        places = [
            (case, first) for case in range(len(self.cases)) for first in range(0, points, size)
        ]
        return tuple(
            Chunk(index, case, first, min(first + size, points))
            for index, (case, first) in enumerate(places)
        )

    @property
    def total(self) -> int:
        """Episodes of all cases."""
        return len(self.cases) * self.design.points * self.episodes

    def tiles(self, chunk: Chunk) -> Iterator[tuple[Tile, int]]:
        """A chunk's tiles, all of one size, and how many episodes of each are its own."""
        case, (points, seeds, _) = self.cases[chunk.case], self.layout
        for first in range(chunk.first, chunk.last, points):
            last = min(first + points, chunk.last)
            here = self.design.at(first, last)
            marks = marks_of(here, last - first) if self.independent else np.zeros(last - first)
            values = {
                one: _filled(here[name], points) for name in here for one in case.fields[name]
            }
            for begin in range(0, self.episodes, seeds):
                which = np.arange(begin, min(begin + seeds, self.episodes), dtype=np.uint32)
                tile = Tile(
                    {name: one.astype(np.float64) for name, one in values.items()},
                    _filled(marks, points).astype(np.uint32),
                    np.repeat(np.arange(last - first, dtype=np.int32), len(which)),
                    np.tile(which, last - first),
                )
                yield tile.filled(points * seeds), len(tile.seeds)

    @cached_property
    def definition(self) -> Definition:
        """What decides the results, as JSON values."""
        swept = self.machine.swept()
        tasks: dict[str, str] = {}
        policies: dict[str, str] = {}
        for one in self.cases:
            tasks.setdefault(one.task, digest_of(one.params, one.steps))
            policies[one.policy] = digest_of(one.player, one.env)
        design = self.design.describe()
        for name, entry in design["axes"].items():
            entry["sets"] = list(self.cases[0].fields[name])
            entry["unit"] = swept.unit(self.cases[0].fields[name][0])
        return {
            "machine": self.machine.name,
            "tasks": tasks,
            "policies": policies,
            "cases": [[one.task, one.policy] for one in self.cases],
            **design,
            "episodes": self.episodes,
            "draws": "independent" if self.independent else "common",
            "rows": "summaries" if self.summaries else "episodes",
        }

    @cached_property
    def digest(self) -> str:
        """Of the definition."""
        text = json.dumps(self.definition, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()

    @property
    def units(self) -> dict[str, str]:
        """Of the axes, by name."""
        return {name: one.get("unit", "-") for name, one in self.definition["axes"].items()}

    @cached_property
    def kept_units(self) -> dict[str, str]:
        """Of what is written of an episode."""
        return dict(self.machine.swept().kept_units(self.cases[0].env))

    @property
    def drawn(self) -> tuple[str, ...]:
        """The tasks whose resets draw."""
        return tuple(dict.fromkeys(one.task for one in self.cases if one.draws))

    @property
    def finished(self) -> tuple[str, ...]:
        """What summaries have of the episodes alone that did not fall."""
        return self.machine.swept().finished


def _filled(values: np.ndarray, count: int) -> np.ndarray:
    """With the last one repeated until there are so many."""
    return np.concatenate([values, np.repeat(values[-1:], count - len(values))])
