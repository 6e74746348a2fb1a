"""Checks of values given by a user, made before tracing. Traced values pass unchecked.

One rule for every number: a real number, or an array, list or tuple of them, not empty, finite in
the precision that it will be computed in. Text, bytes, booleans, None, objects and ragged lists are
refused. Every refusal is a ValueError that names the field, shows what was given in at most a line
and says what is accepted.

JAX and NumPy are imported inside: the command line's help needs names and sizes alone.
"""

from __future__ import annotations

import math
import os
import reprlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from numbers import Integral
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np

MEMORY_LIMIT = "STICKSLIP_MEMORY_LIMIT"
"""The environment variable that holds the most bytes that one request may need."""
DEFAULT_MEMORY_LIMIT = 4 * 2**30
"""Bytes, where the variable is not set."""
SMALL_SIZES = 10**6
"""Whole numbers beyond this are shown by their magnitude."""

_short = reprlib.Repr()
_short.maxstring = _short.maxother = _short.maxlong = 60
_short.maxlist = _short.maxtuple = _short.maxdict = _short.maxarray = 6


def shown(value: object) -> str:
    """The value for a message: its repr on one line, shortened where it is long."""
    text = " ".join(_short.repr(value).split())
    return text if len(text) <= 120 else f"{text[:100]} ... ({len(text)} characters)"


@contextmanager
def reraise(before: str, after: str = "", kind: type[ValueError] = ValueError) -> Iterator[None]:
    """Inside, a ValueError is one of that kind, with words before and behind its message."""
    try:
        yield
    except ValueError as error:
        raise kind(f"{before}{error}{after}") from error


def require_choice(name: str, value: Any, choices: Iterable[str], *, also: str = "") -> None:
    """Raise ValueError unless `value` is one of `choices`, with the nearest of them.

    also: what else the caller accepts, for the message.
    """
    known = tuple(choices)
    if not isinstance(value, str) or value not in known:
        raise ValueError(
            f"{name} = {shown(value)} is unknown; accepted: "
            f"{', '.join([*([also] if also else []), *map(repr, known)])}{nearest(value, known)}"
        )


def require_known(names: Iterable[str], known: Iterable[str], what: str = "field") -> None:
    """Raise ValueError for the first name that is not known: all that are, and the nearest."""
    known = tuple(known)
    for name in names:
        if name not in known:
            accepted = f"{', '.join(known) or 'none'}{nearest(name, known)}"
            raise ValueError(f"{shown(name)} is no {what}; accepted: {accepted}")


def require_that(good: object, name: str, value: Any, accepted: str) -> None:
    """Raise ValueError unless `good`: what the value is, and what is accepted."""
    if not good:
        raise ValueError(f"{name} = {shown(value)}; accepted: {accepted}")


def require_kind(name: str, value: Any, kinds: type | tuple[type, ...], accepted: str) -> None:
    """Raise ValueError unless `value` is an instance of one of the classes."""
    require_that(isinstance(value, kinds), name, value, accepted)


def require_precision(what: str, *kinds: Any) -> None:
    """Raise ValueError for float64 among these types where JAX has it switched off."""
    import jax

    if "float64" in kinds and jax.dtypes.canonicalize_dtype("float64") != "float64":
        raise ValueError(
            f"{what} is float64, which JAX has switched off; accepted: float32, or first "
            'jax.config.update("jax_enable_x64", True) at the start of the program'
        )


def require_both(**values: Any) -> None:
    """Raise ValueError where some of the values are None and others are not."""
    none = [value is None for value in values.values()]
    if any(none) and not all(none):
        given = " with ".join(f"{name} = {shown(value)}" for name, value in values.items())
        raise ValueError(f"{given}; accepted: both, or None")


def nearest(value: object, known: Iterable[str]) -> str:
    """' (did you mean ...?)' for a name that looks like a known one or begins one, else ''."""
    if not isinstance(value, str):
        return ""
    import difflib

    given, names = value[:200].lower(), {name.lower(): name for name in known}
    near = difflib.get_close_matches(given, names, n=1)
    near = near or [name for name in names if len(given) > 2 and name.startswith(given)]
    return f" (did you mean {names[near[0]]}?)" if near else ""


def memory_limit() -> float:
    """The most bytes that one request may need: MEMORY_LIMIT, or the default."""
    given = os.environ.get(MEMORY_LIMIT)
    if given is None:
        return DEFAULT_MEMORY_LIMIT
    try:
        limit = float(given)
    except ValueError:
        limit = math.nan
    require_that(limit > 0, MEMORY_LIMIT, given, "a number of bytes > 0")
    return limit


def require_memory(given: str, what: str, count: float, bytes_each: float) -> None:
    """Raise ValueError where `count` things of so many bytes would not fit the memory limit.

    Call it before anything of that size exists. given: the argument at fault with its value, as
    "spacing = 1e-09"; what: the things, as "waypoints". count: a float may be infinite.
    """
    try:
        needed = float(count) * float(bytes_each)
    except OverflowError:  # an integer that no float holds
        count = needed = float("inf")
    limit = memory_limit()
    if not needed <= limit:
        number = f"{int(count):,}" if count <= SMALL_SIZES else f"{count:.3g}"
        raise ValueError(
            f"{given} makes {number} {what}, about {needed:.2g} bytes; accepted: what fits "
            f"{limit:.3g} bytes (set the environment variable {MEMORY_LIMIT} for more)"
        )


def is_concrete(*values: object) -> bool:
    """True when none of the leaves is an abstract value inside a JAX transformation."""
    import jax
    from jax.core import Tracer

    return not any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(values))


def require_number(
    name: str,
    value: Any,
    *,
    low: float = -math.inf,
    accepted: str,
    strict: bool = False,
    high: float = math.inf,
    dtype: Any = None,
) -> None:
    """Raise ValueError unless every element is finite and low <= it <= high (low < it if strict).

    dtype: the precision that the number will be computed in; by default its own where it is a
    floating array that JAX keeps, else JAX's default type. A number that overflows there is not
    finite, and one that JAX would round to 0 is not > 0.
    """
    import numpy as np

    if not is_concrete(value):
        return
    array = as_real(name, value, accepted)
    rounded = _rounded(value, array, dtype)
    good = np.isfinite(array) & (array <= high) & ((array > low) if strict else (array >= low))
    fits = np.isfinite(rounded) & ((rounded > low) | (not strict) | (low != 0))
    for passed, why in ((good, "is not accepted"), (fits, f"is out of range in {rounded.dtype}")):
        if not np.all(passed):
            bad = array if array.ndim == 0 else array[~passed].flat[0]
            place = "" if array.size == 1 else f" (one of {array.shape})"
            raise ValueError(f"{name} = {bad[()]}{place} {why}; accepted: {accepted}")


def require_increasing(name: str, value: Any, accepted: str) -> None:
    """Raise ValueError, naming the first such entry, unless each is above the one before it."""
    import numpy as np

    row = np.atleast_1d(np.asarray(value, float)) if is_concrete(value) else np.zeros(1)
    for *batch, k in np.argwhere(np.diff(row) <= 0)[:1]:
        last, here = row[(*batch, slice(k, k + 2))]
        raise ValueError(f"{name}[{k + 1}] = {here} after {last}; accepted: {accepted}")


def as_number(name: str, value: Any, *, accepted: str, **rule: Any) -> Any:
    """The value of a field checked by `require_number`, as a pytree leaf.

    Python and NumPy scalars become floats (of the type of the arrays they meet), lists and tuples
    NumPy arrays, whose digits do not depend on JAX's switches; arrays and traced values stay.
    """
    import jax.numpy as jnp
    import numpy as np

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
    whole = isinstance(value, Integral) and not isinstance(value, bool)
    good = whole and low <= int(value) and (high is None or int(value) <= high)
    require_that(good, name, value, accepted)
    return int(value)


def as_real(name: str, value: Any, accepted: str) -> np.ndarray:
    """The value in its own type or in float64; ValueError unless it is a real number."""
    import jax.numpy as jnp
    import numpy as np

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
    import jax
    import numpy as np

    if dtype is None:
        typed = isinstance(value, jax.Array | np.ndarray) and value.dtype.kind == "f"
        dtype = jax.dtypes.canonicalize_dtype(value.dtype if typed else float)
    with np.errstate(over="ignore", under="ignore"):
        rounded = array.astype(dtype)
    tiny = float(jax.numpy.finfo(rounded.dtype).tiny)
    return np.where(np.abs(rounded) < tiny, rounded.dtype.type(0), rounded)
