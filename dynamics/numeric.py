"""The type of a numeric field, and the floating type that a computation works in."""

from typing import Any

import jax
import jax.numpy as jnp

from stickslip.dynamics.checks import shown

Numeric = Any
"""A Python number, a NumPy or a JAX array: given as any of them and read as an array, which no
narrower type says."""


def float_kind(dtype: Any, otherwise: Any):
    """The floating type of a name or a type, `otherwise` for None; ValueError for any other."""
    if dtype is None:
        return jnp.dtype(otherwise)
    try:
        kind = jnp.dtype(dtype)
    except Exception:  # noqa: BLE001, whatever a name or an object raises
        kind = None
    if kind is None or kind not in (jnp.float32, jnp.float64):
        raise ValueError(f"dtype = {shown(dtype)}; accepted: None, float32 or float64")
    return jax.dtypes.canonicalize_dtype(kind)


def float_type(*trees: Any):
    """The widest floating type among the leaves; plain numbers take the arrays' type."""
    leaves = jax.tree.leaves(trees)
    floating = [leaf for leaf in leaves if jnp.issubdtype(jnp.result_type(leaf), jnp.floating)]
    return jnp.result_type(*floating)
