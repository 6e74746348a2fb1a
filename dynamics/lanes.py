"""A while loop whose batch thins out: members that are done cost nothing more.

Under vmap a while loop runs every member as often as the slowest needs. Where most need one round
and a few need many, that is most of the work. Here, the members still going are gathered into a
batch several times smaller, which runs on alone and thins out in turn; results go back in place.
Each member goes through exactly the rounds it would go through by itself.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp

if TYPE_CHECKING:
    from collections.abc import Callable

THINNING = 6
"""How many times smaller each batch is than the one before."""
SMALLEST = 64
"""Batches below this run to their end together."""


def thinning_while(
    going: Callable[[Any, Any], jax.Array],
    body: Callable[[Any, Any], Any],
    args: Any,
    carry: Any,
) -> Any:
    """`lax.while_loop` of carry = body(args, carry) while going(args, carry); thins out under vmap.

    args: everything else that the functions read, as pytrees of arrays (no closures over traced
    values). Not differentiable in reverse mode, as any while loop of unknown length.
    """

    @jax.custom_batching.custom_vmap
    def run(args, carry):
        return jax.lax.while_loop(partial(going, args), partial(body, args), carry)

    @run.def_vmap
    def run_batch(size, batched, args, carry):
        axes = jax.tree.map(lambda is_batched: 0 if is_batched else None, batched[0])
        carry = jax.tree.map(
            lambda leaf, is_batched: (
                leaf if is_batched else jnp.broadcast_to(leaf, (size, *jnp.shape(leaf)))
            ),
            carry,
            batched[1],
        )
        lanes = _Lanes(jax.vmap(going, (axes, 0)), jax.vmap(body, (axes, 0)), axes)
        everyone = jnp.ones(size, bool)
        carry = lanes.finish(args, carry, everyone)
        return carry, jax.tree.map(lambda _: True, carry)

    return run(args, carry)


class _Lanes:
    def __init__(self, going, body, axes):
        self.going, self.body, self.axes = going, body, axes

    def finish(self, args, carry, present):
        """Run the members that are present to their end."""
        size = present.shape[0]

        def active(carry):
            return self.going(args, carry) & present

        def everyone(carry):
            going, after = active(carry), self.body(args, carry)
            return _choose(going, after, carry)

        smaller = size // THINNING
        if smaller < SMALLEST:
            return jax.lax.while_loop(lambda now: jnp.any(active(now)), everyone, carry)

        def some(carry):
            return self._one_batch(args, carry, active(carry), smaller)

        # the first round is everybody's; what it leaves going is few
        return jax.lax.while_loop(lambda now: jnp.any(active(now)), some, everyone(carry))

    def _one_batch(self, args, carry, going, size):
        """Gather up to `size` members that are going, run them to their end, put them back."""
        count = jnp.cumsum(going)
        wanted = jnp.arange(1, size + 1)
        places = jnp.searchsorted(count, wanted)  # past the end for those that do not exist
        own = jax.tree.map(
            lambda leaf, axis: leaf if axis is None else leaf.at[places].get(mode="clip"),
            args,
            self.axes,
            is_leaf=lambda leaf: leaf is None,
        )
        part = jax.tree.map(lambda leaf: leaf.at[places].get(mode="clip"), carry)
        part = self.finish(own, part, wanted <= count[-1])

        def put(leaf, new):
            return leaf.at[places].set(
                new, mode="drop", unique_indices=True, indices_are_sorted=True
            )

        return jax.tree.map(put, carry, part)


def _choose(condition, one, other):
    def leaf(a, b):
        return jnp.where(condition.reshape(condition.shape + (1,) * (a.ndim - 1)), a, b)

    return jax.tree.map(leaf, one, other)
