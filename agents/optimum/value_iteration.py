"""Value iteration over a grid of states: a finite horizon, and the average of an endless process.

Transitions of every action from every node are computed once with the process's own step, then
swept. Results are exact for the process on the grid, in which a step leads to the corners of the
cell that it reaches, at random with the weights of the interpolation; a replay shows how near that
process is to the real one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Generic, NamedTuple, Protocol, TypeAlias, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.optimum.grid import Grid, Place
from stickslip.dynamics.checks import require_integer, require_memory, require_number, shown
from stickslip.dynamics.pytrees import register_pytree
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.agents.optimum.grid import Cell

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
        """The inverse: where a state is."""
        ...

    def step(self, state: State, action: Float[Array, " act"]) -> Transition[State]:
        """One step."""
        ...


class Counts(NamedTuple):
    """Numbers of transitions that end the process, and of others that leave the grid."""

    ended: int
    outside: int
    all: int


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


class Values(NamedTuple):
    """Values of the nodes after so many sweeps."""

    value: Float[Array, " nodes"]
    """Finite horizon: the greatest return in as many steps as sweeps. Average:
    relative to one another."""
    sweeps: int
    low: float
    high: float
    """Bounds of the average reward of a step in the process on the grid, from every node; of a
    finite horizon, the least and the greatest that the last step added at a node."""


Report: TypeAlias = Callable[[Values], None]
"""Callback every TOGETHER sweeps, to store the values."""


def transitions(process: Process[State], outside: float, *, progress: bool = False) -> Transitions:
    """All of them. outside: what leaving the grid is worth, to be set so low that no policy wants
    it: what is not covered is not guessed.

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
    ended = left = done = 0
    with Bar("transitions", grid.size, "node", progress, large=True) as bar:
        for index, sheet in enumerate(grid.sheets):
            nodes = sheet.coordinates().astype(kind)
            nodes = np.pad(nodes, ((0, 0), (0, grid.rank - nodes.shape[1])))
            for first in range(0, len(nodes), block):
                part = nodes[first : first + block]
                size, here = len(part), slice(done, done + len(part))
                filled = np.concatenate([part, np.repeat(part[-1:], block - size, 0)])
                found = _from_nodes(process, index, filled, outside)
                found = [np.asarray(one)[:size] for one in found]
                base[here], share[here], reward[here] = found[:3]
                ended, left = ended + int(np.sum(found[3])), left + int(np.sum(found[4]))
                done += size
                bar.advance(size)
    parts = (jnp.asarray(one.reshape(-1, block, *one.shape[1:])) for one in (base, share, reward))
    return Transitions(*parts, grid, Counts(ended, left, grid.size * count))


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


def finite_horizon(
    table: Transitions,
    steps: int,
    *,
    start: Values | None = None,
    report: Report | None = None,
    progress: bool = False,
) -> Values:
    """The most that can be earned from each node in `steps` steps. start: of an earlier call, to
    resume from."""
    steps = require_integer("steps", steps, high=MOST_SWEEPS)
    now = _begin(table, start)
    with Bar("sweeps", steps, "sweep", progress, at=min(now.sweeps, steps)) as bar:
        while now.sweeps < steps:
            count = min(TOGETHER, steps - now.sweeps)
            value, low, high = _sweep(table, now.value, None, 1.0, count)
            now = Values(value, now.sweeps + count, float(low), float(high))
            if report is not None:
                report(now)
            bar.advance(count)
    return now


def average_reward(
    table: Transitions,
    restart: Cell,
    *,
    tolerance: float = 1e-5,
    most: int = 20_000,
    damping: float = 0.9,
    start: Values | None = None,
    report: Report | None = None,
    progress: bool = False,
) -> Values:
    """Relative value iteration: the greatest average reward of a step of an endless process.

    What ends, or leaves the grid, begins again at a place drawn from `restart`, cells [n]: so every
    node has the same average. It lies between `low` and `high` of the result, of the process on the
    grid, whether or not `tolerance` [reward a step] was reached in `most` sweeps. damping: share
    of each update that is taken, below 1 for processes with a period.
    """
    most = require_integer("most", most, high=MOST_SWEEPS)
    require_number("tolerance", tolerance, low=0.0, strict=True, accepted="finite, > 0")
    require_number("damping", damping, low=0.0, high=1.0, strict=True, accepted="in (0, 1]")
    now = _begin(table, start)
    with Bar("sweeps", None, "sweep", progress, at=now.sweeps) as bar:
        while now.sweeps < most and not now.high - now.low <= tolerance:
            count = min(TOGETHER, most - now.sweeps)
            value, low, high = _sweep(table, now.value, restart, damping, count)
            low, high = max(now.low, float(low)), min(now.high, float(high))
            now = Values(value, now.sweeps + count, low, high)
            if report is not None:
                report(now)
            bar.advance(count, f"{low:.6g} to {high:.6g}")
    return now


@jax.jit
def greedy(
    table: Transitions, value: Float[Array, " nodes"], restart: Cell | None = None
) -> tuple[Float[Array, " nodes"], Int[Array, " nodes"]]:
    """The value one step on from each node, and the number of the action that earns it."""
    restarted = jnp.zeros((), value.dtype)
    if restart is not None:
        restarted = jnp.mean(jax.vmap(partial(table.grid.read, value))(restart))

    def of_block(block: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        base, share, reward = block
        goes_on = base != STOPS
        base = jnp.maximum(base, 0)
        after = jnp.zeros_like(reward)
        for step, weight in table.grid.corners(base, share):
            after = after + weight * value[base + step]
        earned = reward + jnp.where(goes_on, after, restarted)
        return jnp.max(earned, -1), jnp.argmax(earned, -1).astype(jnp.int32)

    best, chosen = jax.lax.map(of_block, (table.base, table.share, table.reward))
    count = table.grid.size
    return best.reshape(-1)[:count], chosen.reshape(-1)[:count]


@partial(jax.jit, static_argnums=4)
def _sweep(
    table: Transitions,
    value: Float[Array, " nodes"],
    restart: Cell | None,
    damping: float,
    count: int,
) -> tuple[Array, Array, Array]:
    """The values after `count` sweeps, least and greatest change of the last one."""

    def body(_: int, carry: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        value = carry[0]
        change = greedy(table, value, restart)[0] - value
        after = value + jnp.asarray(damping, value.dtype) * change
        if restart is not None:  # relative to one another: digits are kept for what differs
            after = after - after[0]
        return after, jnp.min(change), jnp.max(change)

    nothing = jnp.zeros((), value.dtype)
    return jax.lax.fori_loop(0, count, body, (value, nothing, nothing))


def _begin(table: Transitions, start: Values | None) -> Values:
    if start is None:
        nothing = jnp.zeros(table.grid.size, table.reward.dtype)
        return Values(nothing, 0, float("-inf"), float("inf"))
    if jnp.shape(start.value) != (table.grid.size,):
        raise ValueError(
            f"start has values of shape {shown(jnp.shape(start.value))}; accepted: "
            f"({table.grid.size},), one for each node"
        )
    return start._replace(value=jnp.asarray(start.value, table.reward.dtype))
