"""Playing the cells of a sweep: one vmapped program for each kind of case."""

from __future__ import annotations

from contextlib import nullcontext
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from stickslip.agents.evaluation.rollout import episode_key, rollout
from stickslip.agents.sweeps.engine import StoppedError
from stickslip.dynamics.status import Status
from stickslip.envs.adapters.apart import signature_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from jaxtyping import PyTree

    from stickslip.agents.sweeps.cases import Case
    from stickslip.agents.sweeps.plan import Cell, Plan, Tile
    from stickslip.agents.sweeps.swept import Swept

    Keep = Callable[[PyTree, PyTree], PyTree]

ENDINGS = tuple(one.name.lower() for one in Status)
"""Ending of an episode by the number of its last status."""
EXHAUSTED = "RESOURCE_EXHAUSTED"
"""XLA's word for a lack of memory."""


class Player:
    """Plays cells of a plan. Threads may share it: each program is compiled once a device.

    A program is not partitioned over devices: a partitioned one rounds differently, and results
    would depend on the number of devices.
    """

    def __init__(self, plan: Plan):
        self.plan = plan
        self._keep = plan.machine.task_measures(plan.cases[0].env).keep
        self._columns = plan.machine.swept().kept_units(plan.cases[0].env)
        self._places = [one.place for one in plan.cases]
        self._made: dict[PyTree, PyTree] = {}
        self._locks: dict[PyTree, Lock] = {}
        self._lock = Lock()

    @property
    def programs(self) -> int:
        """Number of programs compiled so far."""
        return len(self._made)

    def play(
        self, number: int, device: PyTree = None, stop: Callable[[], bool] = lambda: False
    ) -> dict[str, np.ndarray]:
        """Columns of a cell's episodes [points x episodes], point after point. StoppedError where
        `stop` says so between two tiles; MemoryError where a tile does not fit."""
        cell, parts = self.plan.cells[number], []
        for tile, real in self.plan.tiles(cell):
            if stop():
                raise StoppedError
            kept = self._run(cell, tile, device)
            columns = {name: getattr(kept, name) for name in self._columns}
            columns["fell"] = np.asarray(kept.fell, bool)
            if hasattr(kept, "status"):
                columns["ending"] = np.asarray(kept.status, np.int8)
            parts.append({name: one[:real] for name, one in columns.items()})
        return {name: np.concatenate([one[name] for one in parts]) for name in parts[0]}

    def _run(self, cell: Cell, tile: Tile, device: PyTree) -> PyTree:
        case = self.plan.cases[cell.case]
        try:
            with nullcontext() if device is None else jax.default_device(device):
                arguments = jax.tree.map(jnp.asarray, (case.player, tuple(tile)))
                program = self._program(cell.case, arguments, device)
                return jax.tree.map(np.asarray, program(*arguments))
        except (MemoryError, RuntimeError) as error:
            if not isinstance(error, MemoryError) and EXHAUSTED not in str(error):
                raise
            raise MemoryError(
                f"{len(tile.seeds)} episodes of {case.steps} steps side by side; accepted: a "
                "smaller tile in a new directory"
            ) from error

    def _program(self, number: int, arguments: PyTree, device: PyTree) -> PyTree:
        key = (self._places[number], str(device), *signature_of(arguments))
        with self._lock:
            own = self._locks.setdefault(key, Lock())
        with own:
            if key not in self._made:
                swept, case = self.plan.machine.swept(), self.plan.cases[number]
                played = partial(play_tile, swept, self._keep, case)
                self._made[key] = jax.jit(played).lower(*arguments).compile()
            return self._made[key]


def play_tile(
    swept: Swept,
    keep: Keep,
    case: Case,
    player: PyTree,
    tile: tuple[Mapping[str, PyTree], PyTree, PyTree],
) -> PyTree:
    """Play a tile's episodes and keep what is asked for; pure.

    Parameters that no axis sets are constants; those that depend on an axis are computed once for
    each point. Seed s draws as the first episode after reset(seed=s), the same at every point.
    """
    values, place, seeds = tile
    params, varied = _parameters(swept, case, values)
    here = jax.tree.map(lambda leaf: leaf[place], varied)

    def one(own: dict[int, PyTree], seed: PyTree) -> PyTree:
        leaves, structure = params
        mine = jax.tree.unflatten(structure, [own.get(i, leaf) for i, leaf in enumerate(leaves)])
        return keep(rollout(case.env, player, mine, episode_key(seed), case.steps), mine)

    return jax.vmap(one)(here, seeds)


def _parameters(
    swept: Swept, case: Case, values: Mapping[str, PyTree]
) -> tuple[PyTree, dict[int, PyTree]]:
    """The parameters' leaves and structure; the leaves that depend on an axis, by their index, at
    every point."""
    if not values:
        return jax.tree.flatten(case.params), {}
    found: list[PyTree] = []

    def at(point: Mapping[str, PyTree]) -> dict[int, PyTree]:
        leaves, structure = jax.tree.flatten(swept.put(case.params, point))
        found.append((leaves, structure))
        return {i: leaf for i, leaf in enumerate(leaves) if isinstance(leaf, Tracer)}

    varied = jax.vmap(at)(values)
    return found[-1], varied
