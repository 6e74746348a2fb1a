"""Many steps in one kernel."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, TypeVar

import jax
import jax.numpy as jnp

from stickslip.dynamics.kernels.fused import fused

if TYPE_CHECKING:
    from jaxtyping import Array, Bool

    from stickslip.dynamics.kernels.fused import Fixed

MOST_STEPS = 32
"""Steps in a kernel; with more of them, rows no longer fit the nearest cache."""
LEAST_STEPS = 16
"""Least number where it divides the scan evenly; otherwise kernels leave some steps out."""

Carry = TypeVar("Carry")
Row = TypeVar("Row")


def fused_scan(
    step: Callable[..., tuple[Carry, Row]],
    fixed: Fixed,
    shared: object,
    carry: Carry,
    *,
    length: int,
) -> tuple[Carry, Row]:
    """Scan step(*fixed, shared, carry, None) -> (carry, row) in one kernel: the last carry
    and the rows, every leaf [length, ...].

    step, fixed: hashable, the same at each call, or all compiles again. shared: a pytree of arrays.
    For one member: batch with vmap. Where no kernel holds a step (see `fused`), this is a scan.
    """
    if length == 0:
        return jax.lax.scan(partial(step, *fixed, shared), carry, length=0)
    size = _steps_of_a_kernel(length)
    count = -(-length // size)
    one = partial(_several, step, fixed, size, length % size == 0, shared)
    wanted = jnp.arange(count * size).reshape(count, size) < length
    carry, rows = jax.lax.scan(one, carry, wanted)
    return carry, jax.tree.map(lambda leaf: leaf.reshape(-1, *leaf.shape[2:])[:length], rows)


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
    wanted: Bool[Array, " size"],
) -> tuple[Carry, Row]:
    """Steps in one kernel, those that are wanted. every: whether all are."""
    one = partial(step, *fixed, shared)

    def chosen(carry: Carry, is_wanted: Array) -> tuple[Carry, Row]:
        rows = jax.eval_shape(one, carry, None)[1]
        blank = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), rows)
        return jax.lax.cond(is_wanted, one, lambda carry, _: (carry, blank), carry, None)

    if every:
        return jax.lax.scan(one, carry, length=size)
    return jax.lax.scan(chosen, carry, wanted)
