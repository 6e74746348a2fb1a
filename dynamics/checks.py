"""Checks of values given by a user, made before tracing. Traced values pass unchecked."""

import jax
import numpy as np
from jax.core import Tracer


def is_concrete(*values: object) -> bool:
    """True when none of the leaves is an abstract value inside a JAX transformation."""
    return not any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(values))


def require_number(name: str, value: object, *, low: float, accepted: str, strict: bool = False):
    """Raise ValueError unless every element is finite and >= low (> low when strict)."""
    if not is_concrete(value):
        return
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} = {value!r} is not a number; accepted: {accepted}") from error
    good = np.isfinite(array) & ((array > low) if strict else (array >= low))
    if not np.all(good):
        shown = (
            array.item() if array.ndim == 0 else f"{array[~good].flat[0]} (one of {array.shape})"
        )
        raise ValueError(f"{name} = {shown} is not accepted; accepted: {accepted}")


def require_choice(name: str, value: object, choices: tuple[str, ...]):
    """Raise ValueError unless `value` is one of `choices`."""
    if value not in choices:
        raise ValueError(
            f"{name} = {value!r} is unknown; accepted: {', '.join(map(repr, choices))}"
        )
