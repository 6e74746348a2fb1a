"""The type of a numeric field, and the type, rank and shape of given numbers."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any, cast

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import is_concrete, require_number, shown

Number = jax.Array | np.ndarray | np.number[Any] | int | float
"""Accepted types of a number or an array of numbers."""
Lists = Sequence[Number] | Sequence[Sequence[Number]]
"""Lists that functions make into arrays."""
Numbers = Number | Lists
Numeric = Any
"""The type of a numeric field: given as a Number and read as an array, which no narrower type says.
"""


def float_kind(dtype: Any, otherwise: Any):
    """The floating type of a name or a type, `otherwise` for None; ValueError for any other, and
    for float64 where JAX has it switched off and would compute in float32."""
    if dtype is None:
        return jnp.dtype(otherwise)
    try:
        kind = jnp.dtype(dtype)
    except Exception:  # noqa: BLE001, whatever a name or an object raises
        kind = None
    if kind is None or kind not in (jnp.float32, jnp.float64):
        raise ValueError(f"dtype = {shown(dtype)}; accepted: None, float32 or float64")
    if kind != jax.dtypes.canonicalize_dtype(kind):
        raise ValueError(
            f"dtype = {shown(dtype)}, which JAX has switched off; accepted: float32, or first "
            'jax.config.update("jax_enable_x64", True) at the start of the program'
        )
    return kind


def require_numeric(**values: Any) -> None:
    """Raise ValueError for what is neither a number nor an array of real numbers, whatever its
    value: text, bytes, booleans, None, lists. Cheap, for calls that are made often."""
    for name, value in values.items():
        if isinstance(value, float | int) and not isinstance(value, bool):
            if isinstance(value, int) and abs(value) > sys.float_info.max:
                raise ValueError(
                    f"{name} = {shown(value)} is too large; accepted: a real number or an array"
                )
            continue
        kind = getattr(getattr(value, "dtype", None), "kind", None)
        if kind not in ("f", "i", "u") and getattr(value, "dtype", None) != jnp.bfloat16:
            raise ValueError(
                f"{name} = {shown(value)} is not a number; accepted: a real number or an array"
            )


def same_rank(*values: Number) -> tuple[jax.Array, ...]:
    """The arrays with axes of length 1 in front, so that all have as many; numbers as they are.

    Shapes are broadcast explicitly, so that code runs with jax_numpy_rank_promotion "raise".
    """
    rank = max(map(jnp.ndim, values))
    found = tuple(
        value
        if jnp.ndim(value) in (0, rank)
        else jnp.expand_dims(value, tuple(range(rank - jnp.ndim(value))))
        for value in values
    )
    return cast("tuple[jax.Array, ...]", found)


def as_float(value: Any) -> Any:
    """An integer of Python's as a float: traced, one above 2^31 has no type; others as they are."""
    return float(value) if isinstance(value, int) else value


def with_all_digits(values: np.ndarray) -> jax.Array:
    """The numbers as an array of JAX's, or as they are where JAX would round them now: its switch
    may be turned before they are used."""
    array = jnp.asarray(values)
    return array if array.dtype == values.dtype else cast("jax.Array", values)


def require_one(name: str, value: Any, *, accepted: str, **rule: Any) -> float:
    """One number as a Python float, or ValueError; `rule` as in `require_number`."""
    if not is_concrete(value):
        raise ValueError(f"{name} is traced; accepted: {accepted}, known before tracing")
    require_number(name, value, accepted=accepted, **rule)
    if np.ndim(value):
        raise ValueError(f"{name} has shape {np.shape(value)}; accepted: {accepted}, one number")
    return float(value)


def require_broadcast(**values: Any) -> tuple[int, ...]:
    """The shape that the values broadcast to, or ValueError naming them."""
    shapes = {name: np.shape(value) for name, value in values.items()}
    try:
        return np.broadcast_shapes(*shapes.values())
    except ValueError:
        given = ", ".join(f"{name} {shape}" for name, shape in shapes.items() if shape)
        raise ValueError(f"shapes do not broadcast: {given}; accepted: the same, or ()") from None


def read_only(array: np.ndarray) -> np.ndarray:
    """A read-only copy."""
    kept = np.array(array)
    kept.setflags(write=False)
    return kept
