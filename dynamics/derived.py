"""Pytree dataclasses with parts that follow from their other fields, and so never go stale.

A derived part is a field with init=False, which the constructor does not take: `__post_init__`
computes it, so that `dataclasses.replace` computes it anew from whatever was replaced, and refuses
a derived part by name. JAX rebuilds trees without the constructor (pytrees.py): what it puts
together was together before.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any, TypeVar

import jax
import numpy as np

Tree = TypeVar("Tree")


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
    """True if every leaf is a number, traced or not, and one is no Python int.

    False for trees of what else JAX functions take, such as axes to map over, which are whole
    numbers: nothing can be derived from those.
    """
    leaves = jax.tree.leaves(trees)
    numbers = jax.Array | np.ndarray | np.number | float
    return any(isinstance(leaf, numbers) for leaf in leaves) and all(
        isinstance(leaf, numbers | int) for leaf in leaves
    )
