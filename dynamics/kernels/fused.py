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
from functools import cached_property, lru_cache, partial, wraps
from typing import TYPE_CHECKING, TypeVar

import jax
import jax.numpy as jnp
from jax.core import ShapedArray, Tracer
from jax.extend.core import Primitive, jaxpr_as_fun

from stickslip.dynamics.kernels.grouping import SWITCH, as_one_kernel, run_as_one_kernel
from stickslip.dynamics.kernels.jax_interface import (
    KERNEL,
    jvp_in_front,
    register,
    register_dead_code_rule,
    without_unread,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Sequence

    from jax.extend.core import ClosedJaxpr, JaxprEqn
    from jaxtyping import Array, Bool

    Function = Callable[..., list[Array]]
    Axes = tuple[int | None, ...]
    Fixed = tuple[Hashable, ...]
    Flags = tuple[bool, ...]
    """Flag of each result, or each argument: it is needed."""
    Less = tuple["_Kernel", Flags] | None

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

MOST_STEPS = 32
"""Steps in a kernel; with more of them, rows no longer fit the nearest cache."""
LEAST_STEPS = 16
"""Least number of steps where they divide the scan evenly; otherwise some steps of kernels are left
out."""

Result = TypeVar("Result")
Entry = TypeVar("Entry")
Carry = TypeVar("Carry")
Row = TypeVar("Row")


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
    def run(constants: tuple[Hashable, ...], arguments: tuple[object, ...]) -> Result:
        traced = traced_once.trace(*constants, *arguments)
        leaves = jax.tree.leaves(arguments)
        keys = tuple(map(_is_key, leaves))
        plain = [
            jax.random.key_data(leaf) if is_key else jnp.asarray(leaf)
            for leaf, is_key in zip(leaves, keys, strict=True)
        ]
        kernel = _kernel(traced.jaxpr, keys, os.environ.get(SWITCH))
        found = kernel_p.bind(*plain, kernel=kernel)
        return jax.tree.unflatten(jax.tree.structure(traced.out_info), found)

    @run.defjvp
    def run_jvp(
        constants: tuple[Hashable, ...],
        primals: tuple[tuple[object, ...]],
        tangents: tuple[tuple[object, ...]],
    ) -> tuple[Result, Result]:
        return jvp_in_front(lambda arguments: function(*constants, *arguments), primals, tangents)

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

    def less(needed: Flags) -> Less:
        rest, kept = without_unread(traced, needed)
        return _kernel(rest, _those(keys, kept), switch), tuple(kept)

    return _Kernel(plain, in_kernel, plain, tuple(traced.out_avals), less)


def _those(entries: Iterable[Entry], chosen: Iterable[bool]) -> tuple[Entry, ...]:
    return tuple(entry for entry, one in zip(entries, chosen, strict=True) if one)


def _is_key(leaf: object) -> bool:
    return isinstance(leaf, jax.Array) and jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key)


class _Kernel:
    """A function of arrays, over none, one or several axes of a batch."""

    def __init__(
        self,
        body: Function,
        in_kernels: Function,
        at_once: Function,
        results: tuple[ShapedArray, ...],
        less: Callable[[Flags], Less],
        width: int = 1,
        in_blocks: bool = False,
    ):
        """body: for `width` members together; in_kernels: for all members, as a processor runs it,
        in_blocks: one block after the other; at_once: for all members, as vmap makes it; less: see
        `less`.
        """
        self.body, self.width, self.in_blocks = body, width, in_blocks
        self.in_kernels, self.at_once = jax.jit(in_kernels), jax.jit(at_once)
        self.results = results
        self.over = lru_cache(maxsize=REMEMBERED)(self._over)
        self.less = lru_cache(maxsize=REMEMBERED)(less)
        """The kernel of the results that are needed, and which arguments that one has; None where
        all have to stay."""

    def _over(self, size: int, axes: Axes, widest: int) -> _Kernel:
        """The same for one more axis, which comes first in the arrays that have it.

        widest: numbers of one member's largest array.
        """
        results = tuple(ShapedArray((size, *one.shape), one.dtype) for one in self.results)
        at_once = jax.vmap(self.at_once, axes, axis_size=size)

        def less(needed: Flags) -> Less:
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

    @cached_property
    def alone(self) -> Function:
        """Outside of any trace."""
        return jax.jit(partial(kernel_p.bind, kernel=self))


kernel_p = Primitive(KERNEL)
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
    size = next(
        leaf.shape[axis] for leaf, axis in zip(leaves, axes, strict=True) if axis is not None
    )
    moved = [
        leaf if axis is None else jnp.moveaxis(leaf, axis, 0)
        for leaf, axis in zip(leaves, axes, strict=True)
    ]
    first = tuple(None if axis is None else 0 for axis in axes)
    sizes = [leaf.size for leaf, axis in zip(moved, first, strict=True) if axis is not None]
    widest = max(1, *(one // max(1, size) for one in sizes))
    out = kernel_p.bind(*moved, kernel=kernel.over(size, first, widest))
    return out, [0] * len(out)


def _in_kernels(*leaves: Array, kernel: _Kernel) -> list[Array]:
    return kernel.in_kernels(*leaves)


def _at_once(*leaves: Array, kernel: _Kernel) -> list[Array]:
    return kernel.at_once(*leaves)


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


register(kernel_p, _batched, _at_once, _in_kernels)
register_dead_code_rule(kernel_p, _needed)


def _block(size: int, most: int) -> int:
    """Members of a block: at most so many, as equal as may be, so that little is filled up."""
    if size <= most:
        return size
    even = -(-size // -(-size // most))
    return min(most, GRAIN * -(-even // GRAIN)) if most >= GRAIN else most


def _in_blocks(
    body: Callable[..., list[Array]],
    size: int,
    block: int,
    axes: tuple[int | None, ...],
    *leaves: Array,
) -> list[Array]:
    """A batch of `size`, block by block; the last is filled up with copies of the last member.

    Cut before the kernel and joined after it: on whole arrays XLA uses several threads, which a
    kernel cannot.
    """
    count = -(-size // block)
    parts = [
        leaf if axis is None else cut(leaf, count, block)
        for leaf, axis in zip(leaves, axes, strict=True)
    ]
    found = as_one_kernel(partial(_one_by_one, body, axes))(*parts)
    return [leaf.reshape(count * block, *leaf.shape[2:])[:size] for leaf in found]


def _one_by_one(
    function: Callable[..., list[Array]], axes: tuple[int | None, ...], *leaves: Array
) -> list[Array]:
    """The function of every entry along the first axis of the arrays that have one."""
    shared = [leaf if axis is None else None for leaf, axis in zip(leaves, axes, strict=True)]

    def one(own: list[Array]) -> list[Array]:
        given = iter(own)
        return function(*(next(given) if leaf is None else leaf for leaf in shared))

    own = [leaf for leaf, axis in zip(leaves, axes, strict=True) if axis is not None]
    return jax.lax.map(one, own)


def _only(
    function: Callable[..., list[Array]], axes: tuple[int | None, ...], *leaves: Array
) -> list[Array]:
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


def fused_scan(
    step: Callable[..., tuple[Carry, Row]],
    fixed: Fixed,
    shared: object,
    carry: Carry,
    values: object = None,
    *,
    length: int,
) -> tuple[Carry, Row]:
    """Scan step(*fixed, shared, carry, value) -> (carry, row) in one kernel: the last carry
    and the rows, every leaf [length, ...].

    step, fixed: hashable, the same from call to call, or all is compiled again. shared: a pytree of
    arrays. values: a pytree of arrays [length, ...], or None, which every step is then given. For
    one member: batch with vmap. Where a step cannot be in a kernel (see `fused`), this is a scan.
    """
    if length == 0:
        return jax.lax.scan(partial(step, *fixed, shared), carry, values, length=0)
    size = _steps_of_a_kernel(length)
    count = -(-length // size)

    def one(carry: Carry, part: tuple[object, Array]) -> tuple[Carry, Row]:
        return _several(step, fixed, size, length % size == 0, shared, carry, *part)

    parts = jax.tree.map(lambda leaf: cut(leaf, count, size), values)
    wanted = jnp.arange(count * size).reshape(count, size) < length
    carry, rows = jax.lax.scan(one, carry, (parts, wanted), length=count)
    return carry, jax.tree.map(lambda leaf: _joined(leaf)[:length], rows)


def _steps_of_a_kernel(length: int) -> int:
    even = (
        size for size in range(min(length, MOST_STEPS), LEAST_STEPS - 1, -1) if length % size == 0
    )
    return next(even, -(-length // -(-length // MOST_STEPS)))


@partial(fused, fixed=4)
def _several(
    step: Callable[..., tuple[Carry, Row]],
    fixed: Fixed,
    size: int,
    every: bool,
    shared: object,
    carry: Carry,
    values: object,
    wanted: Bool[Array, " size"],
) -> tuple[Carry, Row]:
    """Steps in one kernel, those that are wanted. every: whether all are."""
    one = partial(step, *fixed, shared)

    def chosen(carry: Carry, part: tuple[object, Array]) -> tuple[Carry, Row]:
        value, is_wanted = part
        rows = jax.eval_shape(one, carry, value)[1]
        blank = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), rows)
        return jax.lax.cond(is_wanted, one, lambda carry, _: (carry, blank), carry, value)

    if every:
        return jax.lax.scan(one, carry, values, length=size)
    return jax.lax.scan(chosen, carry, (values, wanted))


def _joined(leaf: Array) -> Array:
    return leaf.reshape(-1, *leaf.shape[2:])
