"""Pytree dataclasses with parts that follow from their other fields, and so never go stale.

A derived part is a field with init=False, which the constructor does not take: `__post_init__`
computes it, so that `dataclasses.replace` computes it anew from whatever was replaced, and refuses
a derived part by name. JAX rebuilds trees without the constructor: what it puts together was
together before.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from typing import Any, TypeVar

import jax
import numpy as np

Class = TypeVar("Class", bound=type)
Tree = TypeVar("Tree")


def register_derived(cls: Class) -> Class:
    """Register a frozen dataclass as a pytree that is rebuilt without `__post_init__`.

    Fields with metadata {"static": True} are part of the structure, all others are children.
    """
    names = [one.name for one in fields(cls)]
    static = [one.name for one in fields(cls) if one.metadata.get("static")]
    children = [name for name in names if name not in static]
    keys = [jax.tree_util.GetAttrKey(name) for name in children]

    def flatten(tree: object) -> tuple[list[Any], list[Any]]:
        return [getattr(tree, name) for name in children], [getattr(tree, name) for name in static]

    def flatten_with_keys(tree: object):
        parts, rest = flatten(tree)
        return list(zip(keys, parts, strict=True)), tuple(rest)

    def unflatten(rest: tuple[Any, ...], parts: Iterable[Any]):
        tree = object.__new__(cls)
        settle(tree, **dict(zip(static, rest, strict=True)))
        settle(tree, **dict(zip(children, parts, strict=True)))
        return tree

    def flatten_only(tree: object):
        parts, rest = flatten(tree)
        return parts, tuple(rest)

    jax.tree_util.register_pytree_with_keys(cls, flatten_with_keys, unflatten, flatten_only)
    return cls


def settle(tree: Any, **values: Any) -> None:
    """Set fields of an instance that is being made."""
    for name, value in values.items():
        object.__setattr__(tree, name, value)


def rebuilt(tree: Tree, **values: Any) -> Tree:
    """A copy with fields changed, derived ones among them, and nothing computed.

    For those who compute the derived parts themselves, inside the module that defines them.
    """
    copy = object.__new__(type(tree))
    settle(copy, **{**{one.name: getattr(tree, one.name) for one in fields(tree)}, **values})  # type: ignore[arg-type]
    return copy


def holds_numbers(*trees: Any) -> bool:
    """Whether every leaf is a number, traced or not, and one is no Python int.

    False for trees of what else JAX functions take, such as axes to map over, which are whole
    numbers: nothing can be derived from those.
    """
    leaves = jax.tree.leaves(trees)
    numbers = jax.Array | np.ndarray | np.number | float
    return any(isinstance(leaf, numbers) for leaf in leaves) and all(
        isinstance(leaf, numbers | int) for leaf in leaves
    )
