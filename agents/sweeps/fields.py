"""Numeric fields of nested parameters by dotted names, and copies with other numbers in them."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from jaxtyping import PyTree

    from stickslip.dynamics.numeric import Number

Way: TypeAlias = tuple["str | int", ...]
"""Names of fields and entries, places in tuples and arrays, from the top down."""
MOST_ENTRIES = 64
"""Arrays of more numbers are none that somebody sets by hand: they follow from others."""


def numbers_in(tree: PyTree) -> dict[str, Way]:
    """The numbers of a tree of dataclasses, named tuples, dicts, tuples and arrays.

    Names are joined by dots, as "mass.12"; static fields and what is derived are left out.
    """
    return {".".join(map(str, way)): way for way in _ways(tree, ())}


def number_at(tree: PyTree, way: Way) -> PyTree:
    """The number that a way leads to."""
    for step in way:
        tree = _entry(tree, step)
    return tree


def with_number(tree: PyTree, way: Way, value: Number) -> PyTree:
    """A copy with another number there."""
    if not way:
        return value
    step, rest = way[0], way[1:]
    if isinstance(tree, jax.Array | np.ndarray):
        return jnp.asarray(tree).at[way].set(value)
    inner = with_number(_entry(tree, step), rest, value)
    if isinstance(tree, dict):
        return tree | {step: inner}
    if isinstance(tree, tuple):
        values = [
            inner if name == step else one for name, one in zip(_names(tree), tree, strict=True)
        ]
        return type(tree)(*values) if hasattr(tree, "_fields") else tuple(values)
    return replace(tree, **{str(step): inner})


def _entry(tree: PyTree, step: str | int) -> PyTree:
    if isinstance(tree, dict) or isinstance(step, int):
        return tree[step]
    return getattr(tree, step)


def _ways(tree: PyTree, so_far: Way) -> Iterator[Way]:
    if isinstance(tree, bool | np.bool_ | str) or tree is None:
        return
    if isinstance(tree, int | float | np.number):
        yield so_far
    elif isinstance(tree, jax.Array | np.ndarray):
        if tree.dtype.kind == "f" and tree.size <= MOST_ENTRIES:
            yield from ((*so_far, *map(int, place)) for place in np.ndindex(tree.shape))
    elif isinstance(tree, dict):
        for name, one in tree.items():
            yield from _ways(one, (*so_far, name))
    elif is_dataclass(tree) and not isinstance(tree, type):
        for one in fields(tree):
            if one.init and not one.metadata.get("static"):
                yield from _ways(getattr(tree, one.name), (*so_far, one.name))
    elif isinstance(tree, tuple):
        for name, one in zip(_names(tree), tree, strict=True):
            yield from _ways(one, (*so_far, name))


def _names(entries: tuple[PyTree, ...]) -> tuple[str | int, ...]:
    """Of a tuple's entries: its fields, or their places."""
    return getattr(entries, "_fields", tuple(range(len(entries))))
