"""Several steps ahead with the process's own step, and the grid's value at the end.

Where states from which there is no way out are thinner than a cell, the grid does not see them and
its greedy action leads there. The process's own step sees them, as many steps ahead as it takes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import is_concrete, require_integer
from stickslip.dynamics.pytrees import register_pytree

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.optim.dynamic_programming.process import Process, State


@register_pytree
@dataclass(frozen=True)
class Ahead:
    """A beam search: all actions in each of `depth` steps, after each the `beam` best ways kept.

    Another depth compiles nothing anew; beam is static.
    """

    depth: int | Int[Array, ""] = 1
    beam: int = field(default=1, metadata={"static": True})

    def validate(self) -> Ahead:
        """Return self, or raise ValueError naming the field."""
        if is_concrete(self.depth):
            depth = self.depth if isinstance(self.depth, int) else np.asarray(self.depth)[()]
            require_integer("depth", depth, high=1000)
        require_integer("beam", self.beam, high=10**5)
        return self


class Found(NamedTuple):
    """Result of a search."""

    action: Float[Array, " act"]
    value: Float[Array, ""]
    """Reward of the best sequence plus the grid's value at its end."""
    outside: Bool[Array, ""]
    """True if that way leaves the grid: the value is then a guess."""


class _Ways(NamedTuple):
    """Ways that are followed together; every leaf [ways]."""

    state: object
    first: Int[Array, " ways"]
    """Number of the action they began with."""
    earned: Float[Array, " ways"]
    worth: Float[Array, " ways"]
    """Reward so far, and the value at the end."""
    over: Bool[Array, " ways"]
    outside: Bool[Array, " ways"]


def look_ahead(
    process: Process[State],
    values: Float[Array, " nodes"],
    state: State,
    outside: Float[Array, ""] | float,
    ahead: Ahead,
) -> Found:
    """The best first action from a state. outside: what a state off the grid is worth."""
    kind, size = values.dtype, (ahead.beam,)
    one = jnp.arange(ahead.beam) == 0  # the others are copies, which are not counted
    nothing, false = jnp.where(one, 0, -jnp.inf).astype(kind), jnp.zeros(size, bool)
    begun = jax.tree.map(
        lambda leaf: jnp.broadcast_to(jnp.asarray(leaf), size + jnp.shape(leaf)), state
    )
    ways = _Ways(begun, jnp.zeros(size, jnp.int32), nothing, nothing, false, false)

    def further(depth: Int[Array, ""], ways: _Ways) -> _Ways:
        found = _further(process, values, ways, outside)
        count = len(process.actions)
        begins = jnp.tile(jnp.arange(count, dtype=jnp.int32), ahead.beam)
        found = found._replace(first=jnp.where(depth == 0, begins, found.first))
        kept = jax.lax.top_k(found.worth, ahead.beam)[1]
        return jax.tree.map(lambda leaf: leaf[kept], found)

    best = jax.lax.fori_loop(0, ahead.depth, further, ways)
    return Found(process.actions[best.first[0]], best.worth[0], best.outside[0])


def _further(
    process: Process[State],
    values: Float[Array, " nodes"],
    ways: _Ways,
    outside: Float[Array, ""] | float,
) -> _Ways:
    """Each way under each action, one step on."""
    count = len(process.actions)
    ways = jax.tree.map(lambda leaf: jnp.repeat(leaf, count, 0), ways)
    actions = jnp.tile(process.actions, (len(ways.over) // count, 1))

    def one(way: _Ways, action: Float[Array, " act"]) -> _Ways:
        after, reward, ended = process.step(way.state, action)  # pyright: ignore[reportArgumentType]
        earned = way.earned + jnp.where(way.over, 0, reward)
        over = way.over | ended
        cell = process.grid.cell(process.place(after))
        off = jnp.asarray(outside, values.dtype)
        beyond = jnp.where(cell.outside, off, process.grid.read(values, cell))
        worth = earned + jnp.where(over, 0, beyond)
        return _Ways(after, way.first, earned, worth, over, cell.outside & ~over)

    return jax.vmap(one)(ways, actions)
