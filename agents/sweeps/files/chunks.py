"""The chunks of a sweep as pieces of work: played with a plan's programs, written as Parquet."""

from __future__ import annotations

import pickle
from functools import cached_property, partial
from typing import TYPE_CHECKING

from stickslip.agents.sweeps.files.directory import chunk_path
from stickslip.agents.sweeps.files.parquet import chunk_table, write_chunk
from stickslip.agents.sweeps.playing.play import Player

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    import numpy as np
    from jaxtyping import PyTree

    from stickslip.agents.sweeps.plan import Plan


class Chunks:
    """A plan's chunks, in a sweep's directory; see `engine.Work`."""

    def __init__(self, plan: Plan, path: Path):
        self._plan, self._path = plan, path
        self.digest, self.count = plan.digest, len(plan.chunks)

    @cached_property
    def player(self) -> Player:
        """What plays them in this process."""
        return Player(self._plan)

    def size(self, index: int) -> int:
        """Episodes."""
        chunk = self._plan.chunks[index]
        return (chunk.last - chunk.first) * self._plan.episodes

    def play(
        self,
        index: int,
        device: PyTree,
        advance: Callable[[int], None],
        stop: Callable[[], bool],
    ) -> dict[str, np.ndarray]:
        """Its columns."""
        return self.player.play(self._plan.chunks[index], device, advance, stop)

    def keep(self, index: int, found: dict[str, np.ndarray]) -> None:
        """Write a chunk."""
        keep_chunk(self._plan, self._path, index, found)

    def sent(self) -> bytes:
        """The plan, with what plays it."""
        return pickle.dumps(partial(playing, self._plan))


def playing(plan: Plan) -> Callable[[int], dict[str, np.ndarray]]:
    """What plays a plan's chunks by their numbers. Its programs are kept for the next one."""
    player = Player(plan)
    return lambda index: player.play(plan.chunks[index])


def keep_chunk(plan: Plan, path: Path, index: int, columns: dict[str, np.ndarray]) -> None:
    """Write a chunk. OSError naming the file and what to do where the disk will not take it."""
    file = chunk_path(path, index)
    try:
        write_chunk(file, chunk_table(plan, plan.chunks[index], columns))
    except OSError as error:
        raise OSError(
            error.errno,
            f"{file}: {error.strerror or error}; what was written before is whole: make room, and "
            "go on with --resume",
        ) from error
