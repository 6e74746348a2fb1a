"""Lane compaction: work that few members of a batch need is done for those alone.

Under vmap a while loop runs every member as often as the slowest needs, and a condition computes
both of its branches for all. Each member goes through exactly what it would go through by itself.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import jax
import jax.numpy as jnp

from stickslip.dynamics.kernels.jax_interface import jvp_in_front

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Array, Bool, Int

    Flag = Bool[Array, ""]
    Flags = Bool[Array, " members"]

Args = TypeVar("Args")
Carry = TypeVar("Carry")
Tree = TypeVar("Tree")

COMPACTION = 4
"""Factor between the sizes of successive batches."""
SMALLEST, LARGEST = 128, 256
"""Batches below and above run to their end together: looking up costs more than it saves."""


def compacting_while(
    going: Callable[[Args, Carry], Array],
    body: Callable[[Args, Carry], Carry],
    args: Args,
    carry: Carry,
) -> Carry:
    """`lax.while_loop` of carry = body(args, carry) while going(args, carry), compacted under vmap.

    Where most members need one round and a few need many, the members still going are gathered
    into a batch several times smaller, which runs on alone and is compacted in turn; results go
    back in place.
    args: everything else that the functions read, as pytrees of arrays (no closures over traced
    values). Not differentiable in reverse mode, as any while loop of unknown length.
    """

    @jax.custom_batching.custom_vmap
    def run(args: Args, carry: Carry) -> Carry:
        return jax.lax.while_loop(partial(going, args), partial(body, args), carry)

    @run.def_vmap
    def run_batch(size: int, batched: list[Tree], args: Args, carry: Carry) -> tuple[Carry, Tree]:
        axes = jax.tree.map(lambda is_batched: 0 if is_batched else None, batched[0])
        carry = jax.tree.map(partial(_spread, size), batched[1], carry)
        lanes = _Lanes(jax.vmap(going, (axes, 0)), jax.vmap(body, (axes, 0)), axes)
        carry = lanes.finish(args, carry, jnp.ones(size, bool))
        return carry, jax.tree.map(lambda _: True, carry)

    return run(args, carry)


def where_needed(
    needed: Bool[Array, ""],
    function: Callable[..., Carry],
    args: tuple[object, ...],
    otherwise: Carry,
) -> Carry:
    """function(*args) where `needed`, else `otherwise`; in a batch in which no member needs it,
    nothing is computed.

    args: everything that the function reads, as a tuple of pytrees of arrays. Derivatives are those
    of the choice between both.
    """

    @jax.custom_jvp
    def run(needed: Flag, args: tuple[object, ...], otherwise: Carry) -> Carry:
        return choose(needed, args, otherwise)

    @run.defjvp
    def run_jvp(primals: tuple[Tree, ...], tangents: tuple[Tree, ...]):
        def both(needed: Flag, args: tuple[object, ...], otherwise: Carry) -> Carry:
            return jax.tree.map(partial(jnp.where, needed), function(*args), otherwise)

        return jvp_in_front(both, primals, tangents)

    @jax.custom_batching.custom_vmap
    def choose(needed: Flag, args: tuple[object, ...], otherwise: Carry) -> Carry:
        return jax.lax.cond(needed, lambda: function(*args), lambda: otherwise)

    @choose.def_vmap
    def choose_batch(
        size: int,
        batched: list[Any],
        needed: Array,
        args: tuple[object, ...],
        otherwise: Carry,
    ) -> tuple[Carry, Tree]:
        axes = jax.tree.map(lambda is_batched: 0 if is_batched else None, batched[1])
        otherwise = jax.tree.map(partial(_spread, size), batched[2], otherwise)
        needed = _spread(size, batched[0], needed)

        def some():
            found = jax.vmap(function, axes, axis_size=size)(*args)
            return _choose(needed, found, otherwise)

        out = jax.lax.cond(jnp.any(needed), some, lambda: otherwise)
        return out, jax.tree.map(lambda _: True, out)

    return run(needed, args, otherwise)


class _Lanes(Generic[Args, Carry]):
    def __init__(
        self,
        going: Callable[[Args, Carry], Array],
        body: Callable[[Args, Carry], Carry],
        axes: object,
    ):
        self.going, self.body, self.axes = going, body, axes

    def finish(self, args: Args, carry: Carry, present: Flags) -> Carry:
        """Run the members that are present to their end."""
        size = present.shape[0]

        def active(carry: Carry) -> Flags:
            return self.going(args, carry) & present

        def everyone(carry: Carry) -> Carry:
            going, after = active(carry), self.body(args, carry)
            return _choose(going, after, carry)

        smaller = size // COMPACTION
        if not SMALLEST <= size <= LARGEST:
            return jax.lax.while_loop(lambda now: jnp.any(active(now)), everyone, carry)

        def some(carry: Carry) -> Carry:
            return self._one_batch(args, carry, active(carry), smaller)

        # the first round is everybody's; what it leaves going is few
        return jax.lax.while_loop(lambda now: jnp.any(active(now)), some, everyone(carry))

    def _one_batch(self, args: Args, carry: Carry, going: Flags, size: int) -> Carry:
        """Gather up to `size` members that are going, run them to their end, put them back.

        Both ways by looking up: the members' places in the small batch are their ranks.
        """
        rank = jnp.cumsum(going) - 1
        wanted = jnp.arange(size)
        places = jnp.argmax((rank == wanted[:, None]) & going, axis=1)
        leaves, structure = jax.tree.flatten(args)
        axes = structure.flatten_up_to(self.axes)
        batched = [leaf for leaf, axis in zip(leaves, axes, strict=True) if axis is not None]
        batched, part = _picked((batched, carry), places)
        own = iter(batched)
        chosen = [
            leaf if axis is None else next(own) for leaf, axis in zip(leaves, axes, strict=True)
        ]
        part = self.finish(jax.tree.unflatten(structure, chosen), part, wanted <= rank[-1])
        found = _picked(part, jnp.clip(rank, 0, size - 1))
        return _choose(going & (rank < size), found, carry)


def _picked(tree: Carry, places: Int[Array, " places"]) -> Carry:
    """Some members of a batch: all leaves of a type together, which is one look-up, not many."""
    leaves, structure = jax.tree.flatten(tree)
    kinds: dict[jnp.dtype, list[int]] = {}
    for index, leaf in enumerate(leaves):
        kinds.setdefault(leaf.dtype, []).append(index)
    for indices in kinds.values():
        rows = [jnp.reshape(leaves[index], (leaves[index].shape[0], -1)).T for index in indices]
        found = jnp.concatenate(rows)[:, places]
        start = 0
        for index, row in zip(indices, rows, strict=True):
            part = found[start : start + len(row)].T
            leaves[index] = jnp.reshape(part, (len(places), *leaves[index].shape[1:]))
            start += len(row)
    return jax.tree.unflatten(structure, leaves)


def _spread(size: int, is_batched: bool, leaf: Array) -> Array:
    return leaf if is_batched else jnp.broadcast_to(leaf, (size, *jnp.shape(leaf)))


def _choose(condition: Flags, one: Carry, other: Carry) -> Carry:
    def leaf(a: Array, b: Array) -> Array:
        return jnp.where(condition.reshape(condition.shape + (1,) * (a.ndim - 1)), a, b)

    return jax.tree.map(leaf, one, other)
