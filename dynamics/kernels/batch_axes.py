"""Batch axes of functions with a rule for their derivatives.

JAX traces a function of `jax.custom_jvp` twice: for its value, and by its rule. Under vmap it notes
which results of the value have the batch and along which axis, and inside jit takes the rule's for
the same without looking. A rule that computes the value another way may have the batch in another
place, or none: the program is then refused with a message about shapes or, where sizes happen to
agree, gives wrong derivatives.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import jax
import jax.numpy as jnp
from jax.extend.core import Primitive
from jax.interpreters import ad

from stickslip.dynamics.kernels.grouping import IN_FRONT
from stickslip.dynamics.kernels.jax_interface import register

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from jax.core import ShapedArray
    from jaxtyping import Array

Tree = TypeVar("Tree")


def jvp_in_front(
    function: Callable[..., Tree], primals: Sequence[object], tangents: Sequence[object]
) -> tuple[Tree, Tree]:
    """`jax.jvp`, for a rule of a function that has the batch first in all its results where any of
    its arguments has one, as calls of `custom_vmap`, kernels and loops do.
    """
    value, slope = jax.jvp(function, tuple(primals), tuple(tangents))
    mark = _mark(primals)
    return jax.tree.map(lambda leaf: _in_front(leaf, mark), value), jax.tree.map(_in_front, slope)


def _mark(tree: object) -> Array:
    """Nothing [0]: an array that has a batch where an entry of the tree has one."""
    leaves = [jnp.asarray(_data(leaf)) for leaf in jax.tree.leaves(tree)]
    return jnp.concatenate([jnp.ravel(leaf)[:0].astype(bool) for leaf in leaves])


def _data(leaf: Array) -> Array:
    is_key = isinstance(leaf, jax.Array) and jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key)
    return jax.random.key_data(leaf) if is_key else leaf


def _in_front(leaf: Array, *mark: Array) -> Array:
    if leaf.dtype == jax.dtypes.float0:
        return leaf
    return in_front_p.bind(leaf, *mark)


in_front_p = Primitive(IN_FRONT)
"""Its first operand, with the batch first where any operand has one."""


@in_front_p.def_impl
def _itself(leaf: Array, *mark: Array) -> Array:
    del mark
    return leaf


@in_front_p.def_abstract_eval
def _shape(leaf: ShapedArray, *mark: ShapedArray) -> ShapedArray:
    del mark
    return leaf


def _batched(operands: Sequence[Array], axes: Sequence[int | None]) -> tuple[Array, int]:
    size = next(one.shape[at] for one, at in zip(operands, axes, strict=True) if at is not None)
    leaf, axis = operands[0], axes[0]
    if axis is None:
        front = jnp.broadcast_to(leaf, (size, *leaf.shape))
    else:
        front = jnp.moveaxis(leaf, axis, 0)
    return in_front_p.bind(front, *operands[1:]), 0


def _slope(primals: Sequence[Array], tangents: Sequence[object]) -> tuple[Array, object]:
    slope = tangents[0]
    if type(slope) is not ad.Zero:
        slope = in_front_p.bind(slope)
    return in_front_p.bind(*primals), slope


def _back(cotangent: Array, leaf: object) -> list[Array]:
    del leaf
    return [cotangent]


register(in_front_p, _batched, _itself, slope=_slope, back=_back)
