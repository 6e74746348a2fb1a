"""The task that a policy was made for, as its file keeps it: exact JSON values of its parts.

A description says in plain words what a reader wants to know, and holds under "task" every part
from which the same environment and parameters are built again. Kept are the dataclasses of the
machines' modules by name and field, arrays with their type, numbers, texts, tuples and None.
Reading builds nothing else and runs no other code; whether the values make sense is for the
constructors and for `make_params` to say.
"""

import base64
import json
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from importlib import import_module
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.protocol import Task
from stickslip.agents.untrusted import LARGEST_TEXT, Json, RefusedError, refusing
from stickslip.dynamics.checks import require_known, shown
from stickslip.envs.functional import AnyEnv, Timed
from stickslip.records.table import jsonable

Modules: TypeAlias = tuple[str, ...]
Kinds: TypeAlias = dict[str, Any]
TASK = "task"
LONGEST = LARGEST_TEXT - 2**16
"""Characters of a task; what is longer is left out of the file, which then says so."""
CALLED = "Function"
"""The shape of a track that holds a function of the user's, which no file can keep."""
TYPES = ("float32", "float64", "int32", "int64", "bool")
SHORT = 64
"""Arrays of more numbers are written as bytes."""
MOST = 10**5
"""Whole numbers in a task are at most this: counts of pieces, points and steps."""


def in_words(value: Json) -> str:
    """A number with four digits, a list of them in brackets, for people to read."""
    if isinstance(value, list):
        return f"[{', '.join(map(in_words, value))}]"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def described(
    env: AnyEnv, params: Timed, parts: Mapping[str, object], modules: Modules
) -> dict[str, Json]:
    """Description of a task for a policy's metadata: class and choices of the environment, size of
    the observation, and the parts, or why they are not kept."""
    about: dict[str, Json] = {
        "environment": type(env).__name__,
        "choices": jsonable(env),
        "observation_size": len(env.observation_bounds(params)[0]),
    }
    try:
        content: Json = {name: to_json(part, kinds(modules)) for name, part in parts.items()}
        if (length := len(json.dumps(content))) > LONGEST:
            raise ValueError(f"its {length} characters are too many")
    except ValueError as error:
        return {**about, TASK: None, "task_missing": str(error)}
    return {**about, TASK: content}


def read_task(
    metadata: Mapping[str, Json], build: Callable[..., Task], environment: str, modules: Modules
) -> Task | None:
    """The task in a policy's metadata; None where it has none. RefusedError for a damaged one.

    build: makes it of its parts. environment: name of its environment's class.
    """
    content = metadata.get(TASK)
    if content is None:
        return None
    with refusing("its task"):
        if not isinstance(content, dict):
            raise RefusedError("its task is not made of parts")
        parts = {name: from_json(part, kinds(modules)) for name, part in content.items()}
        if type(parts.get("env")).__name__ != environment:
            raise RefusedError(f"its task's environment is no {environment}")
        task = build(**parts)
        if not all(np.all(np.isfinite(one)) for one in task.env.observation_bounds(task.params)):
            raise RefusedError("its task's observations have no bounds")
        return task


def require_numbers(given: object, names: Collection[str], optional: Collection[str]) -> None:
    """Raise RefusedError unless a part holds the numbers of these names, optional ones beside."""
    if not isinstance(given, dict) or set(given) - set(optional) != set(names):
        raise RefusedError(f"its task's numbers are not {', '.join(names)}")


def numbers_in_words(values: Mapping[str, object], drawn: object = None) -> str:
    """Names and numbers, without what is none; and the ranges that a reset draws from."""
    plain = jsonable(values).items()
    numbers = ((name, one) for name, one in plain if isinstance(one, int | float | list))
    words = [f"{name} {in_words(one)}" for name, one in numbers]
    for name, ends in () if drawn is None else vars(drawn).items():
        if isinstance(ends, tuple):
            words.append(f"{name} drawn from {float(ends[0]):.4g} to {float(ends[1]):.4g}")
    return ", ".join(words).replace("_", " ")


def own_machine(
    kind: Any, name: str, path: str | None, changes: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """Arguments of `make_params` in a machine's file or its text: the machine, under `name`, and
    numbers of its motor. changes: single numbers of that machine, or of the default one."""
    if path is None and not changes:
        return {}
    machine, motor = kind.with_motor(path, changes)
    return {name: machine, **motor}


def same_numbers(one: object, other: object) -> bool:
    """True if two trees hold the same numbers, up to rounding to float32."""
    return jax.tree.map(np.float32, one) == jax.tree.map(np.float32, other)


def to_json(value: object, known: Kinds) -> Json:
    """JSON values. ValueError for what cannot be kept: a user's own class or function."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, tuple | list):
        return [to_json(one, known) for one in value]
    if isinstance(value, dict):
        return {"named": {str(name): to_json(one, known) for name, one in value.items()}}
    if isinstance(value, jax.Array | np.ndarray | np.generic):
        return _array_to_json(value)
    name = type(value).__name__
    if not is_dataclass(value) or name == CALLED or known.get(name) is not type(value):
        raise ValueError(f"{shown(value)} cannot be kept; accepted: what the package defines")
    given = (one.name for one in fields(value) if one.init)
    entries = {of: to_json(getattr(value, of), known) for of in given}
    return {"kind": name, **entries}


def from_json(content: Any, known: Kinds) -> Any:
    """Inverse of `to_json`; lists come back as tuples. ValueError for anything else."""
    if isinstance(content, list):
        return tuple(from_json(one, known) for one in content)
    if isinstance(content, int) and abs(content) > MOST:
        raise ValueError(f"{shown(content)} is no whole number up to {MOST}")
    if not isinstance(content, dict):
        return content
    if isinstance(named := content.get("named"), dict):
        return {name: from_json(one, known) for name, one in named.items()}
    if "array" in content:
        return _array_from_json(**content)
    entries = dict(content)
    name = entries.pop("kind", None)
    if not isinstance(name, str) or name == CALLED or name not in known:
        raise ValueError(f"{shown(name)} is no part of a task")
    kind = known[name]
    require_known(entries, [one.name for one in fields(kind) if one.init], f"field of {name}")
    return kind(**{one: from_json(entry, known) for one, entry in entries.items()})


@cache
def kinds(modules: Modules) -> Kinds:
    """The dataclasses of these modules by name, which may be written and read."""
    return {
        one.__name__: one
        for module in map(import_module, modules)
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
