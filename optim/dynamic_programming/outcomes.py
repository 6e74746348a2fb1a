"""Transitions of every action from every node, computed once with the process's own step."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple, Protocol

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_memory, require_number
from stickslip.dynamics.pytrees import register_pytree
from stickslip.optim.dynamic_programming.grid import Grid, Place
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Int

    from stickslip.optim.dynamic_programming.process import Process, State

AT_ONCE = 2**15
"""Steps that are computed together."""
WORKING = 3
"""Times the memory of all transitions that is needed while they are put together and swept."""
STOPS = -1
"""Index in place of a cell where the process has ended, or left the grid."""


class Counts(NamedTuple):
    """Numbers of transitions that end the process, and of others that leave the grid."""

    ended: int
    outside: int
    all: int


class Block(NamedTuple):
    """The transitions of some nodes, in order: see Transitions and Counts."""

    base: Int[np.ndarray, "nodes actions"]
    share: Float[np.ndarray, "nodes actions rank"]
    reward: Float[np.ndarray, "nodes actions"]
    ended: int
    outside: int


class Blocks(Protocol):
    """Store of blocks, from which an interrupted run resumes."""

    def read(self, number: int, shape: tuple[int, int, int], kind: np.dtype) -> Block | None:
        """The block of that number, of so many nodes, actions and coordinates; None: not kept."""
        ...

    def write(self, number: int, block: Block) -> None:
        """Keep a block."""
        ...


@register_pytree
@dataclass(frozen=True)
class Transitions:
    """Transitions of each node under each action, in blocks of nodes; the last block is filled up.

    base, share: the cell that is reached, see Cell; base is STOPS where nothing follows.
    reward: of the step; where it leaves the grid, with what leaving is worth.
    """

    base: Int[Array, "blocks block actions"]
    share: Float[Array, "blocks block actions rank"]
    reward: Float[Array, "blocks block actions"]
    grid: Grid
    counts: Counts = field(metadata={"static": True})


def transitions(
    process: Process[State],
    outside: float,
    *,
    progress: bool = False,
    blocks: Blocks | None = None,
) -> Transitions:
    """All of them. outside: what leaving the grid is worth, to be set so low that no policy wants
    it: what is not covered is not guessed. blocks: where they are kept, and taken from.

    ValueError where the grid is too large for the memory limit, before anything of it exists.
    """
    require_number("outside", outside, accepted="a finite value")
    grid, count = process.grid.validate(), len(process.actions)
    kind = jnp.result_type(process.actions)
    require_room(grid, count, kind.itemsize)
    block = max(1, min(grid.size, AT_ONCE // count))
    padded = -(-grid.size // block) * block
    base = np.empty((padded, count), np.int32)
    share = np.empty((padded, count, grid.rank), kind)
    reward = np.empty((padded, count), kind)
    ended = left = done = number = 0
    with Bar("transitions", grid.size, "node", progress, large=True) as bar:
        for index, sheet in enumerate(grid.sheets):
            nodes = sheet.coordinates().astype(kind)
            nodes = np.pad(nodes, ((0, 0), (0, grid.rank - nodes.shape[1])))
            for first in range(0, len(nodes), block):
                part = nodes[first : first + block]
                shape = (len(part), count, grid.rank)
                found = None if blocks is None else blocks.read(number, shape, kind)
                if found is None:
                    found = _block(process, index, part, block, outside)
                    if blocks is not None:
                        blocks.write(number, found)
                here = slice(done, done + len(part))
                base[here], share[here], reward[here] = found[:3]
                ended, left = ended + found.ended, left + found.outside
                done, number = done + len(part), number + 1
                bar.advance(len(part))
    base[done:], share[done:], reward[done:] = STOPS, 0, 0
    parts = (jnp.asarray(one.reshape(-1, block, *one.shape[1:])) for one in (base, share, reward))
    counts = Counts(ended, left, grid.size * count)
    return Transitions(next(parts), next(parts), next(parts), grid, counts)


def _block(
    process: Process[State], sheet: int, nodes: np.ndarray, size: int, outside: float
) -> Block:
    """Transitions of a sheet's nodes, padded to the compiled size."""
    filled = np.concatenate([nodes, np.repeat(nodes[-1:], size - len(nodes), 0)])
    found = _from_nodes(process, sheet, filled, outside)
    base, share, reward, ended, left = (np.asarray(one)[: len(nodes)] for one in found)
    return Block(base, share, reward, int(np.sum(ended)), int(np.sum(left)))


def require_room(grid: Grid, actions: int, itemsize: int = 4) -> None:
    """ValueError where the transitions of a grid would not fit into memory."""
    each = 4 + (1 + grid.rank) * itemsize
    require_memory(
        f"a grid of {grid.in_words()} with {actions} actions",
        "transitions",
        float(grid.size) * actions,
        WORKING * each,
    )


@jax.jit
def _from_nodes(
    process: Process[State], sheet: int, nodes: Float[Array, "n rank"], outside: float
) -> tuple[Array, Array, Array, Array, Array]:
    """Base, share, reward, ended and left of nodes [n] under all actions, each [n, actions]."""

    def one(node: Float[Array, " rank"], action: Float[Array, " act"]):
        at = Place(jnp.asarray(sheet, jnp.int32), node)
        after, reward, ended = process.step(process.state(at), action)
        cell = process.grid.cell(process.place(after))
        left = cell.outside & ~ended
        reward = reward + jnp.where(left, jnp.asarray(outside, reward.dtype), 0)
        base = jnp.where(ended | left, STOPS, cell.base)
        return base, cell.share, reward, ended, left

    count = len(process.actions)
    each = jnp.repeat(nodes, count, 0), jnp.tile(process.actions, (len(nodes), 1))
    found = jax.vmap(one)(*each)
    return jax.tree.map(lambda leaf: leaf.reshape(len(nodes), count, *leaf.shape[1:]), found)
