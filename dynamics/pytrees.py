"""Frozen dataclasses as pytrees whose structure names their class.

JAX has `jax.tree_util.register_dataclass` for that. Its structures compare equal (JAX 0.10) where
two classes have as many fields and the same static ones: those of a bump and a step, say. A
compiled program is looked up by its arguments' structure, first by hash and then by that
comparison, so that once in some hundred processes, where two hashes happen to fall together, a step
would be driven over by the program of a bump, without a word. Nodes registered with functions of
their own compare their class.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from typing import TypeVar

import jax

from stickslip.dynamics.derived import settle

Class = TypeVar("Class", bound=type)


def register_pytree(cls: Class) -> Class:
    """Register a dataclass as a pytree, in place of `jax.tree_util.register_dataclass`.

    Fields with metadata {"static": True} are part of the structure and hashable, all others are
    children. Structures of two classes differ, whatever their fields. JAX rebuilds trees without
    the constructor and without `__post_init__`: what it puts together was checked and derived
    before. TypeError for what is no dataclass.
    """
    given: object = cls
    if not (isinstance(given, type) and is_dataclass(given)):
        raise TypeError(f"register_pytree of {given!r}; accepted: a class made by @dataclass")
    names = [one.name for one in fields(given)]
    static = [one.name for one in fields(given) if one.metadata.get("static")]
    children = [name for name in names if name not in static]
    keys = [jax.tree_util.GetAttrKey(name) for name in children]

    def flatten(tree: object) -> tuple[list[object], tuple[object, ...]]:
        parts = [getattr(tree, name) for name in children]
        return parts, tuple([getattr(tree, name) for name in static])

    def flatten_with_keys(tree: object):
        parts, rest = flatten(tree)
        return list(zip(keys, parts, strict=True)), rest

    def unflatten(rest: tuple[object, ...], parts: Iterable[object]):
        tree = object.__new__(cls)
        settle(tree, **dict(zip(static, rest, strict=True)))
        settle(tree, **dict(zip(children, parts, strict=True)))
        return tree

    jax.tree_util.register_pytree_with_keys(cls, flatten_with_keys, unflatten, flatten)
    return cls
