"""A function over a batch as one kernel: what makes many small steps fast on a processor.

XLA's CPU backend runs a step of a small model as hundreds of kernels, each started for about a
microsecond, whose results go through memory in between. `fused` has it compile the whole function
into one kernel instead, which goes through a batch in blocks that the nearest cache holds. On other
platforms the function is what `vmap` makes of it, where XLA's own fusion is the better one.
"""

from __future__ import annotations

import os
from functools import partial, wraps
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
from jax.experimental.xla_metadata import set_xla_metadata

from stickslip.dynamics.grouping import LOOPS, grouped

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Sequence

    from jax.extend.core import Jaxpr, JaxprEqn
    from jaxtyping import Array

BLOCK, LARGE_BLOCK = 64, 128
"""Members of a batch that go through the kernel together; the second is faster for large batches
and takes twice as long to compile, since `thinning_while` then thins out."""
LARGE = 1024
"""Members of a large batch."""
LARGEST_ARRAY = 2**14
"""Numbers of an intermediate array: XLA goes through larger ones with several threads, which it
cannot do in a kernel. A function with one is left as XLA takes it."""
SUMMED_UP = ("reduce_sum", "reduce_max", "reduce_min", "reduce_prod", "cum")
LARGEST_SUM = 2**11
"""Sums and the like of more numbers go to a library."""
LARGEST_CUT = 2**13
"""Numbers of a block's part of an argument; blocks are smaller where members are larger."""
GRAIN = 8
"""Where there are several blocks, their size is a multiple of this."""
SWITCH = "STICKSLIP_KERNELS"
"""The environment variable that is set to "off" where XLA cannot compile a kernel."""
AS_ONE_KERNEL = {"xla_cpu_small_call": "true", "inlineable": "false"}
"""What XLA's CPU backend reads of a call. It is not documented there: a test looks for the kernel
in compiled programs; where it is not read, results are the same and slower."""

NEVER_IN_A_KERNEL = (
    *("scatter", "select_and_scatter", "sort", "top_k", "approx_top_k", "fft", "conv_general"),
    *("dot_general", "ragged_dot"),
    *("lu", "qr", "geqrf", "householder", "cholesky", "triangular_solve", "tridiagonal", "eig"),
    *("svd", "schur", "hessenberg", "custom_linear_solve", "ffi_call", "pure_callback"),
    *("io_callback", "debug_callback", "debug_print", "custom_call", "psum", "all_", "ppermute"),
)
"""Beginnings of the names of primitives for which XLA's CPU backend needs a kernel of their own."""

Result = TypeVar("Result")


def fused(function: Callable[..., Result], fixed: int = 0) -> Callable[..., Result]:
    """`function` of pytrees of arrays as one kernel, of one member or, under vmap, of a batch.

    fixed: so many arguments come first that are hashable and no arrays. Positional arguments only,
    random keys of JAX's default kind among them; nothing traced in the function's closure. What
    cannot be in a kernel (sorting, scattering, linear solvers) leaves the function as XLA takes it.
    Members do not see each other: a batch gives what each gives alone, up to roundings. Derivatives
    are those of the function itself, not fused.
    """
    traced_once = jax.jit(function, static_argnums=tuple(range(fixed)))

    @partial(jax.custom_jvp, nondiff_argnums=(0,))
    def run(constants: tuple[Hashable, ...], arguments: tuple[object, ...]) -> Result:
        leaves, structure = jax.tree.flatten(arguments)
        keys = [_is_key(leaf) for leaf in leaves]
        result: list[Any] = []  # the structure of what comes out, known when it is traced

        def flat(*leaves: Array) -> list[Array]:
            given = [
                jax.random.wrap_key_data(leaf) if is_key else leaf
                for leaf, is_key in zip(leaves, keys, strict=True)
            ]
            found = traced_once(*constants, *jax.tree.unflatten(structure, given))
            flattened, result[:] = (parts := jax.tree.flatten(found))[0], parts[1:]
            return flattened

        plain = [
            jax.random.key_data(leaf) if is_key else jnp.asarray(leaf)
            for leaf, is_key in zip(leaves, keys, strict=True)
        ]
        out = _kernel(_Batch(flat, _marked(flat), flat, 1, False))(*plain)
        return jax.tree.unflatten(result[0], out)

    @run.defjvp
    def run_jvp(
        constants: tuple[Hashable, ...],
        primals: tuple[tuple[object, ...]],
        tangents: tuple[tuple[object, ...]],
    ) -> tuple[Result, Result]:
        return jax.jvp(lambda arguments: function(*constants, *arguments), primals, tangents)

    @wraps(function)
    def call(*arguments: object) -> Result:
        return run(tuple(arguments[:fixed]), tuple(arguments[fixed:]))

    return call


def _is_key(leaf: object) -> bool:
    return isinstance(leaf, jax.Array) and jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key)


class _Batch(NamedTuple):
    """A function of arrays, over none, one or several axes of a batch."""

    body: Callable[..., list[Array]]
    """For `width` members together."""
    in_kernels: Callable[..., list[Array]]
    """For all members, as a processor runs it."""
    at_once: Callable[..., list[Array]]
    """For all members, as vmap makes it."""
    width: int
    in_blocks: bool

    def over(self, size: int, axes: Sequence[int | None], widest: int) -> _Batch:
        """The same for one more axis, which comes first in the arrays that have it.

        widest: numbers of one member's largest array.
        """
        at_once = jax.vmap(self.at_once, tuple(axes))
        if self.in_blocks:  # a kernel after the other
            after = partial(_one_by_one, self.in_kernels, tuple(axes))
            return self._replace(in_kernels=after, at_once=at_once)
        most = (LARGE_BLOCK if size * self.width >= LARGE else BLOCK) // self.width
        block = _block(size, max(1, min(most, LARGEST_CUT // widest)))
        body = partial(_only, self.body, tuple(axes))
        if block > 1:
            body = jax.vmap(self.body, tuple(axes))
        if block == size:
            return _Batch(body, _marked(body), at_once, block * self.width, False)
        in_kernel = partial(_in_blocks, body, size, block, tuple(axes))
        return _Batch(body, in_kernel, at_once, block * self.width, True)


def _kernel(batch: _Batch) -> Callable[..., list[Array]]:
    """The function as one kernel where a processor runs it; under vmap, for one more axis."""

    @jax.custom_batching.custom_vmap
    def call(*leaves: Array) -> list[Array]:
        return jax.lax.platform_dependent(*leaves, cpu=batch.in_kernels, default=batch.at_once)

    @call.def_vmap
    def call_batch(size: int, batched: list[bool], *leaves: Array):
        axes = [0 if is_batched else None for is_batched in batched]
        widest = max(
            leaf.size // max(1, size) for leaf, one in zip(leaves, batched, strict=True) if one
        )
        out = _kernel(batch.over(size, axes, max(1, widest)))(*leaves)
        return out, [True] * len(out)

    return call


def _marked(function: Callable[..., list[Array]]) -> Callable[..., list[Array]]:
    """The function as a call that XLA is asked to compile as one kernel, if that can be."""

    def call(*leaves: Array) -> list[Array]:
        traced = jax.make_jaxpr(function)(*leaves)
        if switched_off() or not _can_be_one(traced.jaxpr):
            return list(function(*leaves))
        inner = jax.jit(partial(_and_first, grouped(traced)))
        out, first = inner(*jax.lax.optimization_barrier(leaves))
        marked = [set_xla_metadata(leaf, **AS_ONE_KERNEL) for leaf in (*out, *first)]
        return list(jax.lax.optimization_barrier(marked)[: len(out)])

    return call


def _and_first(function: Callable[..., list[Array]], *leaves: Array):
    """What the function returns, and the first number of every argument.

    XLA's compiler gives up the process over a kernel with an argument that nothing in it reads. The
    caller keeps these numbers from being pruned by passing them through a barrier.
    """
    first: dict[jnp.dtype, list[Array]] = {}
    for leaf in leaves:
        first.setdefault(leaf.dtype, []).append(jnp.ravel(leaf)[:1])
    return function(*leaves), [jnp.concatenate(parts) for parts in first.values()]


def switched_off() -> bool:
    """Whether the user wants no kernels: SWITCH is "off" when a function is traced."""
    return os.environ.get(SWITCH, "").lower() in ("off", "0", "no", "false")


def _can_be_one(jaxpr: Jaxpr) -> bool:
    """Whether nothing in there calls a library or needs more than loops over small arrays."""
    return all(map(_can_be_in_one, jaxpr.eqns))


def _can_be_in_one(equation: JaxprEqn) -> bool:
    name = equation.primitive.name
    atoms = [*equation.outvars]
    most = LARGEST_ARRAY
    if name.startswith(SUMMED_UP):
        atoms, most = [*equation.invars], LARGEST_SUM
    large = name not in LOOPS and any(getattr(atom.aval, "size", 0) > most for atom in atoms)
    if large or name.startswith(NEVER_IN_A_KERNEL):
        return False
    leaves = jax.tree.leaves(
        list(equation.params.values()), is_leaf=lambda leaf: hasattr(leaf, "eqns")
    )
    jaxprs = [getattr(leaf, "jaxpr", leaf) for leaf in leaves if hasattr(leaf, "eqns")]
    if name == "scan":  # what is cut out of its arguments is an array of its own
        cut = jaxprs[0].invars[equation.params["num_consts"] :]
        if any(atom.aval.size > LARGEST_ARRAY for atom in cut):
            return False
    return all(map(_can_be_one, jaxprs))


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
    cut = [
        leaf if axis is None else _cut(leaf, count, block)
        for leaf, axis in zip(leaves, axes, strict=True)
    ]
    found = _marked(partial(_one_by_one, body, axes))(*cut)
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


def _cut(leaf: Array, count: int, block: int) -> Array:
    """[count, block, ...] of [size, ...]."""
    missing = count * block - leaf.shape[0]
    if missing:
        last = jnp.broadcast_to(leaf[-1:], (missing, *leaf.shape[1:]))
        leaf = jnp.concatenate([leaf, last])
    return leaf.reshape(count, block, *leaf.shape[1:])
