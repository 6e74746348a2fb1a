"""Value iteration over a grid of states, for a finite horizon.

Transitions of every action from every node are computed once with the process's own step, then
swept. Results are exact for the process on the grid, in which a step leads to the corners of the
cell that it reaches, at random with the weights of the interpolation; a replay shows how near that
process is to the real one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Generic, NamedTuple, Protocol, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.optimum.grid import Grid, Place
from stickslip.dynamics.checks import require_integer, require_memory, require_number
from stickslip.dynamics.pytrees import register_pytree
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

State = TypeVar("State")

AT_ONCE = 2**15
"""Steps that are computed together."""
WORKING = 3
"""Times the memory of all transitions that is needed while they are put together and swept."""
STOPS = -1
"""Index in place of a cell where the process has ended, or left the grid."""
TOGETHER = 10
"""Sweeps between two reports of progress."""
MOST_SWEEPS = 10**7


class Transition(NamedTuple, Generic[State]):
    """Result of a step. ended: nothing more is earned."""

    state: State
    reward: Float[Array, ""]
    ended: Bool[Array, ""]


class Process(Protocol[State]):
    """A deterministic system in discrete time; a pytree whose methods work under jit and vmap."""

    @property
    def grid(self) -> Grid:
        """The nodes."""
        ...

    @property
    def actions(self) -> Float[Array, "count act"]:
        """Those among which is chosen."""
        ...

    def state(self, place: Place) -> State:
        """The state at a place of the grid."""
        ...

    def place(self, state: State) -> Place:
        """The inverse: the place of a state."""
        ...

    def step(self, state: State, action: Float[Array, " act"]) -> Transition[State]:
        """One step."""
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


def transitions(process: Process[State], outside: float, *, progress: bool = False) -> Transitions:
    """Transitions of all nodes under all actions. outside: value of leaving the grid, so low that
    no policy wants it: what is not covered is not guessed.

    ValueError where the grid is too large for the memory limit, before anything of it exists.
    """
    require_number("outside", outside, accepted="a finite value")
    grid, count = process.grid.validate(), len(process.actions)
    kind = jnp.result_type(process.actions)
    require_memory(
        f"a grid of {grid.in_words()} with {count} actions",
        "transitions",
        float(grid.size) * count,
        WORKING * (4 + (1 + grid.rank) * kind.itemsize),
    )
    block = max(1, min(grid.size, AT_ONCE // count))
    padded = -(-grid.size // block) * block
    base = np.full((padded, count), STOPS, np.int32)
    share = np.zeros((padded, count, grid.rank), kind)
    reward = np.zeros((padded, count), kind)
    done = 0
    with Bar("transitions", grid.size, "node", progress, large=True) as bar:
        for index, sheet in enumerate(grid.sheets):
            nodes = sheet.coordinates().astype(kind)
            nodes = np.pad(nodes, ((0, 0), (0, grid.rank - nodes.shape[1])))
            for first in range(0, len(nodes), block):
                part = nodes[first : first + block]
                size, here = len(part), slice(done, done + len(part))
                filled = np.concatenate([part, np.repeat(part[-1:], block - size, 0)])
                found = _from_nodes(process, index, filled, outside)
                base[here], share[here], reward[here] = (np.asarray(one)[:size] for one in found)
                done += size
                bar.advance(size)
    parts = (jnp.asarray(one.reshape(-1, block, *one.shape[1:])) for one in (base, share, reward))
    return Transitions(next(parts), next(parts), next(parts), grid)


@jax.jit
def _from_nodes(
    process: Process[State], sheet: int, nodes: Float[Array, "n rank"], outside: float
) -> tuple[Array, Array, Array]:
    """Base, share and reward of nodes [n] under all actions, each [n, actions]."""

    def one(node: Float[Array, " rank"], action: Float[Array, " act"]):
        at = Place(jnp.asarray(sheet, jnp.int32), node)
        after, reward, ended = process.step(process.state(at), action)
        cell = process.grid.cell(process.place(after))
        left = cell.outside & ~ended
        reward = reward + jnp.where(left, jnp.asarray(outside, reward.dtype), 0)
        base = jnp.where(ended | left, STOPS, cell.base)
        return base, cell.share, reward

    count = len(process.actions)
    each = jnp.repeat(nodes, count, 0), jnp.tile(process.actions, (len(nodes), 1))
    found = jax.vmap(one)(*each)
    return jax.tree.map(lambda leaf: leaf.reshape(len(nodes), count, *leaf.shape[1:]), found)


def finite_horizon(table: Transitions, steps: int, *, progress: bool = False) -> Array:
    """The most that can be earned from each node in `steps` steps [nodes]."""
    steps = require_integer("steps", steps, high=MOST_SWEEPS)
    value, done = jnp.zeros(table.grid.size, table.reward.dtype), 0
    with Bar("sweeps", steps, "sweep", progress) as bar:
        while done < steps:
            count = min(TOGETHER, steps - done)
            value, done = _sweep(table, value, count), done + count
            bar.advance(count)
    return value


@jax.jit
def backed_up(table: Transitions, value: Float[Array, " nodes"]) -> Float[Array, " nodes"]:
    """The value of each node one step earlier: the maximum over actions (Bellman's equation)."""

    def of_block(block: tuple[Array, Array, Array]) -> Array:
        base, share, reward = block
        goes_on = base != STOPS
        base = jnp.maximum(base, 0)
        after = jnp.zeros_like(reward)
        for step, weight in table.grid.corners(base, share):
            after = after + weight * value[base + step]
        earned = reward + jnp.where(goes_on, after, jnp.zeros((), value.dtype))
        return jnp.max(earned, -1)

    best = jax.lax.map(of_block, (table.base, table.share, table.reward))
    return best.reshape(-1)[: table.grid.size]


@partial(jax.jit, static_argnums=2)
def _sweep(table: Transitions, value: Float[Array, " nodes"], count: int) -> Array:
    """The values after `count` sweeps."""

    def body(_: int, value: Array) -> Array:
        return value + (backed_up(table, value) - value)  # to the bit what damped sweeps gave

    return jax.lax.fori_loop(0, count, body, value)
