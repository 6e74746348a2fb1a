"""Long sums in short numbers: a clock that counts its steps, and compensated summation."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import jax
import jax.numpy as jnp

if TYPE_CHECKING:
    from jaxtyping import Array, Float

Terms = TypeVar("Terms")


def clock(time: Float[Array, ""], step: Float[Array, ""]) -> Float[Array, ""]:
    """time + step without the roundings of earlier steps: (n + 1) step where time is n step.

    n is found from the time itself: within a rounding, and up to 2^21 in single precision. Any
    other time is added to. Derivatives are those of the sum.
    """
    plain, epsilon = time + step, jnp.finfo(time.dtype).eps
    count = jnp.round(time / step)
    counts = (jnp.abs(count * step - time) <= epsilon * jnp.abs(time)) & (count < 0.25 / epsilon)
    return plain + jax.lax.stop_gradient(jnp.where(counts, (count + 1) * step - plain, 0.0))


def compensated(sums: Terms, rests: Terms, terms: Terms) -> tuple[Terms, Terms]:
    """sums + terms, and their rounding errors so far; trees of floating arrays.

    Begin with rests of 0. A sum of any length is good to a few roundings of its own: Knuth's exact
    error of an addition, fed back as Kahan does. A sum that overflows stays infinite.
    """
    totals, tree = jax.tree.flatten(sums)
    columns = zip(totals, *map(jax.tree.leaves, (rests, terms)), strict=True)
    after, left = zip(*(_added(*column) for column in columns), strict=True)
    return jax.tree.unflatten(tree, after), jax.tree.unflatten(tree, left)


def _added(total: Array, rest: Array, term: Array) -> tuple[Array, Array]:
    term = term + rest
    after = total + term
    added = after - total
    rest = (total - (after - added)) + (term - added)
    return after, jnp.where(jnp.isfinite(after), rest, 0.0)
