"""Checks of values given by a user, made before tracing. Traced values pass unchecked.

One rule for every number: a real number, or an array, list or tuple of them, not empty, finite in
the precision that it will be computed in. Text, bytes, booleans, None, objects and ragged lists are
refused. Every refusal is a ValueError that names the field, shows what was given in at most a line
and says what is accepted.
"""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from stickslip.dynamics.plain_checks import (
    DEFAULT_MEMORY_LIMIT,
    MEMORY_LIMIT,
    SMALL_SIZES,
    memory_limit,
    nearest,
    require_choice,
    require_kind,
    require_known,
    require_memory,
    shown,
)

__all__ = [
    "DEFAULT_MEMORY_LIMIT",
    "MEMORY_LIMIT",
    "SMALL_SIZES",
    "as_number",
    "as_real",
    "is_concrete",
    "memory_limit",
    "nearest",
    "require_choice",
    "require_integer",
    "require_kind",
    "require_known",
    "require_memory",
    "require_number",
    "shown",
]


def is_concrete(*values: object) -> bool:
    """True when none of the leaves is an abstract value inside a JAX transformation."""
    return not any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(values))


def require_number(
    name: str,
    value: Any,
    *,
    low: float = -np.inf,
    accepted: str,
    strict: bool = False,
    high: float = np.inf,
    dtype: Any = None,
) -> None:
    """Raise ValueError unless every element is finite and low <= it <= high (low < it if strict).

    dtype: the precision that the number will be computed in; by default its own where it is a
    floating array that JAX keeps, else JAX's default type. A number that overflows there is not
    finite, and one that JAX would round to 0 is not > 0.
    """
    if not is_concrete(value):
        return
    array = as_real(name, value, accepted)
    rounded = _rounded(value, array, dtype)
    good = np.isfinite(array) & (array <= high) & ((array > low) if strict else (array >= low))
    fits = np.isfinite(rounded) & ((rounded > low) | (not strict) | (low != 0))
    for passed, why in ((good, "is not accepted"), (fits, f"is out of range in {rounded.dtype}")):
        if not np.all(passed):
            bad = array if array.ndim == 0 else array[~passed].flat[0]
            place = "" if array.ndim == 0 else f" (one of {array.shape})"
            raise ValueError(f"{name} = {bad.item()!r}{place} {why}; accepted: {accepted}")


def as_number(name: str, value: Any, *, accepted: str, **rule: Any) -> Any:
    """The value of a field checked by `require_number`, as a pytree leaf.

    Python and NumPy scalars become floats (which take the type of the arrays they meet), lists and
    tuples NumPy arrays, whose digits do not depend on JAX's switches; arrays and traced values pass
    unchanged.
    """
    require_number(name, value, accepted=accepted, **rule)
    if isinstance(value, list | tuple):
        return np.array(value, float) if is_concrete(value) else jnp.stack(value)
    if isinstance(value, np.number | int) and not isinstance(value, np.floating):
        return float(value)
    return value


def require_integer(
    name: str, value: Any, *, low: int = 1, high: int | None = None, accepted: str | None = None
) -> int:
    """The integer, or ValueError unless it is one from low to high; booleans are none."""
    if accepted is None:
        accepted = f"an integer >= {low}" + ("" if high is None else f", <= {high}")
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool | np.bool_)
    if not whole or value < low or (high is not None and value > high):
        raise ValueError(f"{name} = {shown(value)}; accepted: {accepted}")
    return int(value)


def as_real(name: str, value: Any, accepted: str) -> np.ndarray:
    """The value in its own type or in float64; ValueError unless it is a real number."""
    if isinstance(value, np.ma.MaskedArray):
        raise ValueError(f"{name} is a masked array; accepted: {accepted}")
    try:
        array = np.asarray(value)
    except Exception as error:  # whatever an object's own conversion raises
        raise ValueError(
            f"{name} = {shown(value)} is not a number; accepted: {accepted}"
        ) from error
    if not (np.issubdtype(array.dtype, np.integer) or jnp.issubdtype(array.dtype, jnp.floating)):
        raise ValueError(f"{name} = {shown(value)} is not a number; accepted: {accepted}")
    if array.size == 0:
        raise ValueError(f"{name} has shape {array.shape}, no number; accepted: {accepted}")
    return array if array.dtype.itemsize >= 4 and array.dtype.kind == "f" else array.astype(float)


def _rounded(value: Any, array: np.ndarray, dtype: Any) -> np.ndarray:
    """The numbers in JAX's precision, 0 where they are subnormal there."""
    if dtype is None:
        typed = isinstance(value, jax.Array | np.ndarray) and value.dtype.kind == "f"
        dtype = jax.dtypes.canonicalize_dtype(value.dtype if typed else float)
    with np.errstate(over="ignore", under="ignore"):
        rounded = array.astype(dtype)
    tiny = float(jnp.finfo(rounded.dtype).tiny)
    return np.where(np.abs(rounded) < tiny, rounded.dtype.type(0), rounded)
