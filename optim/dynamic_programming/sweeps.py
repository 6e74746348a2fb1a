"""Value iteration over stored transitions: a finite horizon, and the average over an endless one.

Both are exact for the process on the grid, in which a step leads to the corners of the cell that it
reaches, at random with the weights of the interpolation. Whether that process is the one that is
meant only a replay tells.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp

from stickslip.dynamics.checks import require_integer, require_number, shown
from stickslip.optim.dynamic_programming.outcomes import STOPS, Transitions
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Int

    from stickslip.optim.dynamic_programming.grid import Cell

TOGETHER = 10
"""Sweeps between two looks at progress."""
MOST_SWEEPS = 10**7


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


def finite_horizon(
    table: Transitions,
    steps: int,
    *,
    start: Values | None = None,
    report: Report | None = None,
    progress: bool = False,
) -> Values:
    """The most that can be earned from each node in `steps` steps.

    start: of an earlier call, to go on with. report: see Report.
    """
    steps = require_integer("steps", steps, high=MOST_SWEEPS)
    now = _begin(table, start)
    with Bar("sweeps", steps, "sweep", progress, at=min(now.sweeps, steps)) as bar:
        while now.sweeps < steps:
            count = min(TOGETHER, steps - now.sweeps)
            value, low, high = _sweep_often(table, now.value, None, 1.0, count)
            now = _told(Values(value, now.sweeps + count, float(low), float(high)), report)
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
            value, low, high = _sweep_often(table, now.value, restart, damping, count)
            low, high = max(now.low, float(low)), min(now.high, float(high))
            now = _told(Values(value, now.sweeps + count, low, high), report)
            bar.advance(count, f"{low:.6g} to {high:.6g}")
    return now


@jax.jit
def greedy(
    table: Transitions, value: Float[Array, " nodes"], restart: Cell | None = None
) -> tuple[Float[Array, " nodes"], Int[Array, " nodes"]]:
    """The value one step on from each node, and the number of the action that earns it."""
    again = jnp.zeros((), value.dtype)
    if restart is not None:
        again = jnp.mean(jax.vmap(partial(table.grid.read, value))(restart))

    def of_block(block: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        base, share, reward = block
        goes_on = base != STOPS
        base = jnp.maximum(base, 0)
        after = jnp.zeros_like(reward)
        for step, weight in table.grid.corners(base, share):
            after = after + weight * value[base + step]
        earned = reward + jnp.where(goes_on, after, again)
        return jnp.max(earned, -1), jnp.argmax(earned, -1).astype(jnp.int32)

    best, chosen = jax.lax.map(of_block, (table.base, table.share, table.reward))
    count = table.grid.size
    return best.reshape(-1)[:count], chosen.reshape(-1)[:count]


@partial(jax.jit, static_argnums=4)
def _sweep_often(
    table: Transitions,
    value: Float[Array, " nodes"],
    restart: Cell | None,
    damping: float,
    count: int,
) -> tuple[Array, Array, Array]:
    """The values after so many sweeps, least and greatest change of the last one."""

    def once(_: int, carry: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        value = carry[0]
        change = greedy(table, value, restart)[0] - value
        after = value + jnp.asarray(damping, value.dtype) * change
        if restart is not None:  # relative to one another: digits are kept for what differs
            after = after - after[0]
        return after, jnp.min(change), jnp.max(change)

    nothing = jnp.zeros((), value.dtype)
    return jax.lax.fori_loop(0, count, once, (value, nothing, nothing))


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


def _told(now: Values, report: Report | None) -> Values:
    if report is not None:
        report(now)
    return now
