"""Batches of poses as one kernel: see stickslip.dynamics.kernels.fused."""

from __future__ import annotations

from math import prod
from typing import TYPE_CHECKING, Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from stickslip.dynamics.kernels.fused import fused
from stickslip.dynamics.pytrees import float_type

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Array, Real

    from stickslip.dynamics.numeric import Number
    from stickslip.dynamics.ugv.params import UGVParams

Result = TypeVar("Result")


def over_poses(
    function: Callable[..., Result],
    fixed: tuple[Any, ...],
    params: UGVParams,
    ground: Any,
    x_front: Real[Number, "..."],
    leg_angles: Real[Number, "... 2"],
    *numbers: Real[Number, "..."],
) -> Result:
    """function(*fixed, params, ground, x_front, leg_angles, *numbers), in one kernel if it can be.

    function: elementwise over leading axes of x_front, leg_angles, the vehicle's and the other
    numbers, with a `status` among its results. fixed: hashable. ground: pytrees that all poses
    share. Where not every result is one of one pose, as on ground that is a batch itself, or where
    other numbers have more axes than the poses, the function is called as it is.
    """
    given = (params, ground, x_front, leg_angles, *numbers)
    dtype = float_type(params, ground, x_front, leg_angles)
    arrays = jax.tree.map(lambda leaf: _as_float(leaf, dtype), given)
    params_, ground_, x, angles, *others = arrays
    own = (params_, *others)
    vehicles = [leaf.shape for leaf in jax.tree.leaves(params_)]
    shape: Any = jnp.broadcast_shapes(x.shape, angles.shape[:-1], *vehicles)
    if not (
        prod(shape) > 0
        and float_type(dtype.type(0), *numbers) == dtype
        and all(_fits(leaf, shape) for leaf in others)
        and _shared(function, fixed, params_, ground_, others, dtype)
    ):
        return function(*fixed, *given)
    one = fused(function, fixed=len(fixed))
    if shape == ():
        return one(*fixed, params_, ground_, x, angles, *others)

    def flat(leaf: Array) -> Array:
        return jnp.broadcast_to(leaf, shape).reshape(-1) if leaf.ndim else leaf

    def axis(leaf: Array) -> int | None:
        return 0 if leaf.ndim else None

    axes = jax.tree.map(axis, own)
    params_, *others = jax.tree.map(flat, own)
    x = jnp.broadcast_to(x, shape).reshape(-1)
    angles = jnp.broadcast_to(angles, (*shape, 2)).reshape(-1, 2)

    def each(params, x, angles, *others):
        return one(*fixed, params, ground_, x, angles, *others)

    found = jax.vmap(each, (axes[0], 0, 0, *axes[1:]))(params_, x, angles, *others)
    return jax.tree.map(lambda leaf: leaf.reshape(*shape, *leaf.shape[1:]), found)


def _as_float(leaf: Any, dtype: Any) -> Array:
    kind = jnp.result_type(leaf)
    return jnp.asarray(leaf, dtype if jnp.issubdtype(kind, jnp.floating) else kind)


def _fits(leaf: Array, shape: Any) -> bool:
    """True if it has no axes, or some of the poses'."""
    try:
        return np.broadcast_shapes(leaf.shape, shape) == shape
    except ValueError:
        return False


def _shared(
    function: Callable[..., Any],
    fixed: tuple[Any, ...],
    params: UGVParams,
    ground: Any,
    numbers: list[Array],
    dtype: Any,
) -> bool:
    """True if the ground is one for all poses, and nothing traced hides in a function of it."""

    def one(leaf: Array) -> jax.ShapeDtypeStruct:
        return jax.ShapeDtypeStruct((), leaf.dtype)

    def status(params, ground, x, angles, *numbers):
        return function(*fixed, params, ground, x, angles, *numbers).status

    places = jax.ShapeDtypeStruct((), dtype), jax.ShapeDtypeStruct((2,), dtype)
    ground = jax.tree.map(lambda leaf: jax.ShapeDtypeStruct(leaf.shape, leaf.dtype), ground)
    params, *numbers = jax.tree.map(one, (params, *numbers))
    try:
        traced = jax.make_jaxpr(status)(params, ground, *places, *numbers)
    except (TypeError, ValueError):  # shapes that do not go with one place
        return False
    hidden = any(isinstance(one, Tracer) for one in traced.consts)
    return not hidden and traced.out_avals[0].shape == ()
