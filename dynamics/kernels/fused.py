"""Fused functions: a function over a batch as one kernel, for many small steps on a CPU.

XLA's CPU backend runs a step of a small model as hundreds of kernels, each started for about a
microsecond, whose results go through memory in between. `fused` has it compile the whole function
into one kernel instead, which goes through a batch in blocks that the nearest cache holds. On other
platforms the function is what `vmap` makes of it, where XLA's own fusion is the better one.

Until it is lowered, a fused function is one operation of JAX's, which vmap widens without tracing
it: only what a platform compiles is traced, grouped and cut into blocks. Results that a program
does not use are dropped from it before.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Iterable, Sequence
from functools import lru_cache, partial, wraps
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
from jax.core import ShapedArray, Tracer
from jax.extend.core import ClosedJaxpr, JaxprEqn, Primitive, jaxpr_as_fun

from stickslip.dynamics import pytrees
from stickslip.dynamics.kernels import jax_interface
from stickslip.dynamics.kernels.grouping import SWITCH, as_one_kernel, run_as_one_kernel

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Int

    from stickslip.dynamics.pytrees import Flag

    Function = Callable[..., list[Array]]
    Axes = tuple[int | None, ...]
    Fixed = tuple[Hashable, ...]
    Given = tuple[object, ...]
    """Pytrees of arrays."""
    Needed = tuple[bool, ...]
    """True for each result, or each argument, that is needed."""
    Less = tuple["_Kernel", Needed] | None
    Flags = Bool[Array, " members"]

BLOCK, LARGE_BLOCK = 64, 128
"""Members of a batch that go through the kernel together; the second is faster for large batches
and takes twice as long to compile, since `compacting_while` then compacts its lanes."""
LARGE = 1024
"""Members of a large batch."""
LARGEST_CUT = 2**13
"""Numbers of a block's part of an argument; blocks are smaller where members are larger."""
GRAIN = 8
"""The size of blocks is a multiple of this where there are several."""
REMEMBERED = 128
"""Kernels that are not built anew when another program needs them."""

COMPACTION = 4
"""Factor between the sizes of successive batches."""
SMALLEST, LARGEST = 128, 256
"""Batches below and above run to their end together: looking up costs more than it saves."""

Result = TypeVar("Result")
Entry = TypeVar("Entry")
Args = TypeVar("Args")
Carry = TypeVar("Carry")
Tree = TypeVar("Tree")


def fused(function: Callable[..., Result], fixed: int = 0) -> Callable[..., Result]:
    """`function` of pytrees of arrays as one kernel, of one member or, under vmap, of a batch.

    fixed: so many arguments come first that are hashable and no arrays. Positional arguments only,
    random keys of JAX's default kind among them. What cannot be in a kernel (sorting, scattering,
    linear solvers, something traced in the function's closure) leaves the function as XLA takes it.
    Members do not see each other: a batch gives what each gives alone, up to roundings. Derivatives
    are those of the function itself, not fused.
    """
    traced_once = jax.jit(function, static_argnums=tuple(range(fixed)))

    @partial(jax.custom_jvp, nondiff_argnums=(0,))
    def run(constants: Fixed, arguments: Given) -> Result:
        traced = traced_once.trace(*constants, *arguments)
        leaves = jax.tree.leaves(arguments)
        kernel = _kernel(traced.jaxpr, tuple(map(pytrees.is_key, leaves)), os.environ.get(SWITCH))
        found = kernel_p.bind(*map(pytrees.as_plain, leaves), kernel=kernel)
        return jax.tree.unflatten(jax.tree.structure(traced.out_info), found)

    @run.defjvp
    def run_jvp(constants: Fixed, primals: tuple[Given], tangents: tuple[Given]):
        return jax_interface.jvp_in_front(
            lambda arguments: function(*constants, *arguments), primals, tangents
        )

    @wraps(function)
    def call(*arguments: object) -> Result:
        # Without jit its user wants to see the function's own numbers.
        if jax.config.jax_disable_jit:  # pyright: ignore[reportAttributeAccessIssue]
            return function(*arguments)
        traced = traced_once.trace(*arguments).jaxpr
        hidden = any(isinstance(constant, Tracer) for constant in traced.consts)
        if hidden or len(traced.in_avals) != len(jax.tree.leaves(arguments[fixed:])):
            return traced_once(*arguments)
        return run(tuple(arguments[:fixed]), tuple(arguments[fixed:]))

    return call


@lru_cache(maxsize=REMEMBERED)
def _kernel(traced: ClosedJaxpr, keys: tuple[bool, ...], switch: str | None) -> _Kernel:
    """Kernel of a traced function; keys: its arguments that are random keys; switch: the variable
    SWITCH, which is part of what is remembered."""
    function = jaxpr_as_fun(traced)

    def read(*leaves: Array) -> list[Array]:
        return [
            jax.random.wrap_key_data(leaf) if is_key else leaf
            for leaf, is_key in zip(leaves, keys, strict=True)
        ]

    def plain(*leaves: Array) -> list[Array]:
        return list(function(*read(*leaves)))

    def in_kernel(*leaves: Array) -> list[Array]:
        return run_as_one_kernel(traced, leaves, read)

    def less(needed: Needed) -> Less:
        rest, kept = jax_interface.without_unread(traced, needed)
        return _kernel(rest, _those(keys, kept), switch), tuple(kept)

    return _Kernel(plain, in_kernel, plain, tuple(traced.out_avals), less)


def _those(entries: Iterable[Entry], chosen: Iterable[bool]) -> tuple[Entry, ...]:
    return tuple(entry for entry, one in zip(entries, chosen, strict=True) if one)


class _Kernel:
    """A function of arrays, over none, one or several axes of a batch."""

    def __init__(
        self,
        body: Function,
        in_kernels: Function,
        at_once: Function,
        results: tuple[ShapedArray, ...],
        less: Callable[[Needed], Less],
        width: int = 1,
        in_blocks: bool = False,
    ):
        """body: for `width` members together; in_kernels: for all members, as a processor runs it,
        in_blocks: one block after the other; at_once: for all, as vmap makes it; less: see `less`.
        """
        self.body, self.width, self.in_blocks = body, width, in_blocks
        self.in_kernels, self.at_once = jax.jit(in_kernels), jax.jit(at_once)
        self.results = results
        self.over = lru_cache(maxsize=REMEMBERED)(self._over)
        self.less = lru_cache(maxsize=REMEMBERED)(less)
        """The kernel of the needed results, and its arguments; None where all have to stay."""
        self.alone = jax.jit(partial(kernel_p.bind, kernel=self))
        """Outside of any trace."""

    def _over(self, size: int, axes: Axes, widest: int) -> _Kernel:
        """The same for one more axis, which comes first in the arrays that have it.

        widest: numbers of one member's largest array.
        """
        results = tuple(ShapedArray((size, *one.shape), one.dtype) for one in self.results)
        at_once = jax.vmap(self.at_once, axes, axis_size=size)

        def less(needed: Needed) -> Less:
            found = self.less(needed)
            own = _those(axes, found[1]) if found else ()
            if not found or all(axis is None for axis in own):  # nothing says how many there are
                return None
            return found[0].over(size, own, widest), found[1]

        if self.in_blocks:  # a kernel after the other
            after = partial(_one_by_one, self.in_kernels, axes)
            return _Kernel(self.body, after, at_once, results, less, self.width, True)
        most = (LARGE_BLOCK if size * self.width >= LARGE else BLOCK) // self.width
        block = _block(size, max(1, min(most, LARGEST_CUT // widest)))
        body = partial(_only, self.body, axes)
        if block > 1:
            body = jax.vmap(self.body, axes)
        if block == size:
            return _Kernel(body, as_one_kernel(body), at_once, results, less, block * self.width)
        in_kernel = partial(_in_blocks, body, size, block, axes)
        return _Kernel(body, in_kernel, at_once, results, less, block * self.width, True)


kernel_p = Primitive(jax_interface.KERNEL)
kernel_p.multiple_results = True


@kernel_p.def_abstract_eval
def _shapes(*arguments: ShapedArray, kernel: _Kernel) -> list[ShapedArray]:
    return list(kernel.results)


@kernel_p.def_impl
def _outside_a_trace(*leaves: Array, kernel: _Kernel) -> list[Array]:
    return kernel.alone(*leaves)


def _batched(
    leaves: Sequence[Array], axes: Sequence[int | None], *, kernel: _Kernel
) -> tuple[list[Array], list[int]]:
    size = next(leaf.shape[at] for leaf, at in zip(leaves, axes, strict=True) if at is not None)
    moved = [
        leaf if axis is None else jnp.moveaxis(leaf, axis, 0)
        for leaf, axis in zip(leaves, axes, strict=True)
    ]
    first = tuple(None if axis is None else 0 for axis in axes)
    sizes = [leaf.size for leaf, axis in zip(moved, first, strict=True) if axis is not None]
    widest = max(1, *(one // max(1, size) for one in sizes))
    out = kernel_p.bind(*moved, kernel=kernel.over(size, first, widest))
    return out, [0] * len(out)


def _needed(needed: list[bool], equation: JaxprEqn) -> tuple[list[bool], JaxprEqn | None]:
    """Without the results that nothing reads: which arguments are left, and the operation."""
    kernel, arguments = equation.params["kernel"], equation.invars
    if not any(needed):
        return [False] * len(arguments), None
    found = None if all(needed) else kernel.less(tuple(needed))
    if found is None:
        return [True] * len(arguments), equation
    less, kept = found
    rest = equation.replace(
        invars=list(_those(arguments, kept)),
        outvars=list(_those(equation.outvars, needed)),
        params={"kernel": less},
    )
    return list(kept), rest


jax_interface.register(
    kernel_p,
    _batched,
    anywhere=lambda *leaves, kernel: kernel.at_once(*leaves),
    on_cpu=lambda *leaves, kernel: kernel.in_kernels(*leaves),
    unread=_needed,
)


def _block(size: int, most: int) -> int:
    """Members of a block: at most so many, as equal as may be, so that little is filled up."""
    if size <= most:
        return size
    even = -(-size // -(-size // most))
    return min(most, GRAIN * -(-even // GRAIN)) if most >= GRAIN else most


def _in_blocks(body: Function, size: int, block: int, axes: Axes, *leaves: Array) -> list[Array]:
    """A batch of `size`, block by block; the last is filled up with copies of the last member.

    Cut before and joined after the kernel: on whole arrays XLA uses several threads, a kernel one.
    """
    count = -(-size // block)
    parts = [
        leaf if axis is None else cut(leaf, count, block)
        for leaf, axis in zip(leaves, axes, strict=True)
    ]
    found = as_one_kernel(partial(_one_by_one, body, axes))(*parts)
    return [leaf.reshape(count * block, *leaf.shape[2:])[:size] for leaf in found]


def _one_by_one(function: Function, axes: Axes, *leaves: Array) -> list[Array]:
    """The function of every entry along the first axis of the arrays that have one."""
    shared = [leaf if axis is None else None for leaf, axis in zip(leaves, axes, strict=True)]

    def one(own: list[Array]) -> list[Array]:
        given = iter(own)
        return function(*(next(given) if leaf is None else leaf for leaf in shared))

    own = [leaf for leaf, axis in zip(leaves, axes, strict=True) if axis is not None]
    return jax.lax.map(one, own)


def _only(function: Function, axes: Axes, *leaves: Array) -> list[Array]:
    """The function of a batch of one."""
    one = [leaf if axis is None else leaf[0] for leaf, axis in zip(leaves, axes, strict=True)]
    return [leaf[None] for leaf in function(*one)]


def cut(leaf: Array, count: int, block: int) -> Array:
    """[count, block, ...] of [size, ...], filled up with copies of the last member."""
    missing = count * block - leaf.shape[0]
    if missing:
        last = jnp.broadcast_to(leaf[-1:], (missing, *leaf.shape[1:]))
        leaf = jnp.concatenate([leaf, last])
    return leaf.reshape(count, block, *leaf.shape[1:])


def compacting_while(
    going: Callable[[Args, Carry], Array],
    body: Callable[[Args, Carry], Carry],
    args: Args,
    carry: Carry,
) -> Carry:
    """`lax.while_loop` of carry = body(args, carry) while going(args, carry), compacted under vmap.

    vmap's own loop runs every member as often as the slowest needs. Where a few need many rounds,
    the members still going are gathered into a batch several times smaller, which runs on alone and
    is compacted in turn; results go back in place, each what the member computes by itself.
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
    needed: Flag, function: Callable[..., Carry], args: Given, otherwise: Carry
) -> Carry:
    """function(*args) where `needed`, else `otherwise`; nothing is computed that none needs, where
    vmap's own condition computes both branches for all.

    args: everything that the function reads, as a tuple of pytrees of arrays. Derivatives are those
    of the choice between both.
    """

    @jax.custom_jvp
    def run(needed: Flag, args: Given, otherwise: Carry) -> Carry:
        return choose(needed, args, otherwise)

    @run.defjvp
    def run_jvp(primals: tuple[Tree, ...], tangents: tuple[Tree, ...]):
        def both(needed: Flag, args: Given, otherwise: Carry) -> Carry:
            return jax.tree.map(partial(jnp.where, needed), function(*args), otherwise)

        return jax_interface.jvp_in_front(both, primals, tangents)

    @jax.custom_batching.custom_vmap
    def choose(needed: Flag, args: Given, otherwise: Carry) -> Carry:
        return jax.lax.cond(needed, lambda: function(*args), lambda: otherwise)

    @choose.def_vmap
    def choose_batch(
        size: int, batched: list[Any], needed: Array, args: Given, otherwise: Carry
    ) -> tuple[Carry, Tree]:
        axes = jax.tree.map(lambda is_batched: 0 if is_batched else None, batched[1])
        otherwise = jax.tree.map(partial(_spread, size), batched[2], otherwise)
        needed = _spread(size, batched[0], needed)

        def some():
            return _choose(needed, jax.vmap(function, axes, axis_size=size)(*args), otherwise)

        out = jax.lax.cond(jnp.any(needed), some, lambda: otherwise)
        return out, jax.tree.map(lambda _: True, out)

    return run(needed, args, otherwise)


class _Lanes(NamedTuple, Generic[Args, Carry]):
    going: Callable[[Args, Carry], Array]
    body: Callable[[Args, Carry], Carry]
    axes: object

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
        chosen = [leaf if at is None else next(own) for leaf, at in zip(leaves, axes, strict=True)]
        part = self.finish(jax.tree.unflatten(structure, chosen), part, wanted <= rank[-1])
        return _choose(going & (rank < size), _picked(part, jnp.clip(rank, 0, size - 1)), carry)


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
