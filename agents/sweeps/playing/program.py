"""The compiled programs of a sweep: a tile of episodes at a time, parameters made inside."""

from __future__ import annotations

import os
from contextlib import nullcontext
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from stickslip.agents.evaluation.rollout import episode_key, rollout
from stickslip.envs.adapters.apart import signature_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from jaxtyping import PyTree

    from stickslip.agents.sweeps.playing.case import Case
    from stickslip.agents.sweeps.swept import Swept

EXHAUSTED = "RESOURCE_EXHAUSTED"
"""What XLA calls a lack of memory."""
SMALLEST = 1
"""Episodes of a tile that is not divided any more."""


class Tile(NamedTuple):
    """Episodes played side by side. values: of the fields that axes set, by dotted names, each
    [points]; marks: of each point [points]; place: which point an episode is of [episodes]; seeds:
    [episodes]."""

    values: dict[str, np.ndarray]
    marks: np.ndarray
    place: np.ndarray
    seeds: np.ndarray

    def part(self, where: slice) -> Tile:
        """Some of its episodes, over the same points."""
        return self._replace(place=self.place[where], seeds=self.seeds[where])

    def filled(self, size: int) -> Tile:
        """With its first episode repeated until there are so many."""
        missing = size - len(self.seeds)
        places = np.concatenate([self.place, np.repeat(self.place[:1], missing)])
        return self._replace(
            place=places, seeds=np.concatenate([self.seeds, np.repeat(self.seeds[:1], missing)])
        )


class Programs:
    """Programs by what they are compiled for; `count` of them so far. Threads may share it.

    Each is of one device, so that a result does not depend on how many there are: one program
    partitioned over several differs from it by roundings, which a walk makes large.
    """

    def __init__(self, swept: Swept, keep: Callable[[PyTree, PyTree], PyTree], independent: bool):
        self._swept, self._keep, self._independent = swept, keep, independent
        self._made: dict[PyTree, PyTree] = {}
        self._locks: dict[PyTree, Lock] = {}
        self._lock = Lock()

    @property
    def count(self) -> int:
        """How many were compiled."""
        return len(self._made)

    def play(self, case: Case, place: str, tile: Tile, device: PyTree = None) -> PyTree:
        """What is kept of the tile's episodes, arrays of NumPy's.

        Where memory does not suffice the tile is divided and played in halves; MemoryError if that
        does not help. place: the case's, which is not computed again.
        """
        try:
            return self._played(case, place, tile, device)
        except (MemoryError, RuntimeError) as error:
            if not is_memory(error):
                raise
            size = len(tile.seeds)
            if size <= SMALLEST:
                raise MemoryError(f"one episode of {case.steps} steps") from error
            half = -(-size // 2)
            low = self.play(case, place, tile.part(slice(0, half)), device)
            high = self.play(case, place, tile.part(slice(half, None)).filled(half), device)
            return jax.tree.map(lambda a, b: np.concatenate([a, b[: size - half]]), low, high)

    def _played(self, case: Case, place: str, tile: Tile, device: PyTree) -> PyTree:
        with nullcontext() if device is None else jax.default_device(device):
            arguments = jax.tree.map(jnp.asarray, (case.player, tuple(tile)))
            key = (place, str(device), *signature_of(arguments))
            with self._lock:
                own = self._locks.setdefault(key, Lock())
            with own:
                if key not in self._made:
                    self._made[key] = self._compile(case, arguments)
                program = self._made[key]
            return jax.tree.map(np.asarray, program(*arguments))

    def _compile(self, case: Case, arguments: PyTree) -> PyTree:
        played = partial(play_tile, self._swept, self._keep, self._independent, case)
        return jax.jit(played).lower(*arguments).compile()


def play_tile(
    swept: Swept,
    keep: Callable[[PyTree, PyTree], PyTree],
    independent: bool,
    case: Case,
    player: PyTree,
    tile: tuple[Mapping[str, PyTree], PyTree, PyTree, PyTree],
) -> PyTree:
    """What is kept of a tile's episodes; pure.

    What axes do not set is constant; what follows from what they set is computed once for each
    point. Seed s draws as the first episode after reset(seed=s) does, at every point the same, or
    with independent=True by the point's mark, too.
    """
    values, marks, place, seeds = tile
    params, varied = _parameters(swept, case, values)
    here, mark = jax.tree.map(lambda leaf: leaf[place], (varied, marks))

    def one(own: dict[int, PyTree], mark: PyTree, seed: PyTree) -> PyTree:
        leaves, structure = params
        mine = jax.tree.unflatten(structure, [own.get(i, leaf) for i, leaf in enumerate(leaves)])
        key = episode_key(seed)
        if independent:
            key = jax.random.fold_in(key, mark)
        return keep(rollout(case.env, player, mine, key, case.steps), mine)

    return jax.vmap(one)(here, mark, seeds)


def _parameters(
    swept: Swept, case: Case, values: Mapping[str, PyTree]
) -> tuple[PyTree, dict[int, PyTree]]:
    """The parameters' leaves and structure, and of the leaves that depend on an axis, by their
    place among all, the numbers at every point."""
    if not values:
        return jax.tree.flatten(case.params), {}
    found: list[PyTree] = []

    def at(point: Mapping[str, PyTree]) -> dict[int, PyTree]:
        leaves, structure = jax.tree.flatten(swept.put(case.params, point))
        found.append((leaves, structure))
        return {i: leaf for i, leaf in enumerate(leaves) if isinstance(leaf, Tracer)}

    varied = jax.vmap(at)(values)
    return found[-1], varied


def is_memory(error: BaseException) -> bool:
    """Whether an error says that memory did not suffice."""
    return isinstance(error, MemoryError) or EXHAUSTED in str(error)


def memory_at_hand(limit: float) -> float:
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
