"""The type of a numeric field, and the floating type that a computation works in."""

from typing import Any

import jax
import jax.numpy as jnp

Numeric = Any
"""A Python number, a NumPy or a JAX array: given as any of them and read as an array, which no
narrower type says."""


def float_type(*trees: Any):
    """The widest floating type among the leaves; plain numbers take the arrays' type."""
    leaves = jax.tree.leaves(trees)
    floating = [leaf for leaf in leaves if jnp.issubdtype(jnp.result_type(leaf), jnp.floating)]
    return jnp.result_type(*floating)
