"""Exact conversion of a task's parts to JSON values and back.

Kept are the dataclasses of the machines' modules by name and field, arrays with their type,
numbers, texts, tuples and None. Reading builds nothing else and runs no other code; whether the
values make sense is for the constructors and for `make_params` to say.
"""

from __future__ import annotations

import base64
import math
from dataclasses import fields, is_dataclass
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.registry import machines
from stickslip.dynamics.checks import require_known, shown

if TYPE_CHECKING:
    from stickslip.agents.untrusted import Json

CALLED = "Function"
"""The shape of a track that holds a function of the user's, which no file can keep."""
TYPES = ("float32", "float64", "int32", "int64", "bool")
SHORT = 64
"""Arrays of more numbers are written as bytes."""
MOST = 10**5
"""Whole numbers in a task are at most this: counts of pieces, points and steps."""


def to_json(value: object) -> Json:
    """JSON values. ValueError for what cannot be kept: a user's own class or function."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, tuple | list):
        return [to_json(one) for one in value]
    if isinstance(value, dict):
        return {"named": {str(name): to_json(one) for name, one in value.items()}}
    if isinstance(value, jax.Array | np.ndarray | np.generic):
        return _array_to_json(value)
    name = type(value).__name__
    if not is_dataclass(value) or name == CALLED or kinds().get(name) is not type(value):
        raise ValueError(f"{shown(value)} cannot be kept; accepted: what the package defines")
    entries = {one.name: to_json(getattr(value, one.name)) for one in fields(value) if one.init}
    return {"kind": name, **entries}


def from_json(content: Any) -> Any:
    """Inverse of `to_json`; lists come back as tuples. ValueError for anything else."""
    if isinstance(content, list):
        return tuple(from_json(one) for one in content)
    if isinstance(content, int) and abs(content) > MOST:
        raise ValueError(f"{shown(content)} is no whole number up to {MOST}")
    if not isinstance(content, dict):
        return content
    if isinstance(named := content.get("named"), dict):
        return {name: from_json(one) for name, one in named.items()}
    if "array" in content:
        return _array_from_json(**content)
    entries = dict(content)
    name = entries.pop("kind", None)
    if not isinstance(name, str) or name == CALLED or name not in kinds():
        raise ValueError(f"{shown(name)} is no part of a task")
    kind = kinds()[name]
    require_known(entries, [one.name for one in fields(kind) if one.init], f"field of {name}")
    return kind(**{one: from_json(entry) for one, entry in entries.items()})


def kinds() -> dict[str, Any]:
    """The dataclasses that may be written and read, by name: those of the machines' modules."""
    return _kinds(tuple(name for machine in machines() for name in machine.modules))


@cache
def _kinds(names: tuple[str, ...]) -> dict[str, Any]:
    return {
        one.__name__: one
        for module in map(import_module, names)
        for one in vars(module).values()
        if is_dataclass(one) and isinstance(one, type) and one.__module__ == module.__name__
    }


def _array_to_json(value: jax.Array | np.ndarray | np.generic) -> dict[str, Json]:
    array = np.asarray(value)
    if array.dtype.name not in TYPES:
        raise ValueError(f"numbers of type {array.dtype} cannot be kept; accepted: {TYPES}")
    short = array.size <= SHORT
    return {
        "array": array.tolist() if short else base64.b64encode(array.tobytes()).decode(),
        "shape": list(array.shape),
        "type": array.dtype.name,
        "host": not isinstance(value, jax.Array),
    }


def _array_from_json(array: Any, shape: list[int], type: str, host: bool) -> Any:
    if type not in TYPES or len(shape) > 4:
        raise ValueError(f"an array of type {shown(type)} and shape {shown(shape)}")
    if isinstance(array, str):
        raw = base64.b64decode(array, validate=True)
        if math.prod(shape) * np.dtype(type).itemsize != len(raw):
            raise ValueError(f"an array of shape {shown(shape)} over {len(raw)} bytes")
        values = np.frombuffer(raw, type).reshape(shape).copy()
    else:
        values = np.asarray(array, type).reshape(shape)
    if not np.all(np.isfinite(values)):
        raise ValueError("an array with entries that are not finite")
    return values if host else jnp.asarray(values)
