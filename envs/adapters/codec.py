"""A pytree of many small arrays as one array of words: a compiled call costs per array."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

Tree = TypeVar("Tree")


@dataclass(frozen=True)
class Codec(Generic[Tree]):
    """The layout of one pytree, from `Codec.of` its abstract values; static and hashable.

    `pack` gives one array [words, *batch] of unsigned integers that hold the leaves' bits, `unpack`
    the tree. A word is as wide as the widest leaf's numbers, 4 bytes at least. batch: the shape
    that all leaves begin with.
    """

    structure: Hashable
    shapes: tuple[tuple[int, ...], ...]
    dtypes: tuple[str, ...]
    batch: tuple[int, ...]

    @classmethod
    def of(cls, tree: Tree, batch: tuple[int, ...] = ()) -> Codec[Tree]:
        """The layout of `tree`, whose leaves (arrays or abstract arrays) begin with `batch`."""
        leaves, structure = jax.tree.flatten(tree)
        shapes = tuple(tuple(leaf.shape[len(batch) :]) for leaf in leaves)
        return cls(structure, shapes, tuple(str(leaf.dtype) for leaf in leaves), batch)

    @property
    def of_one(self) -> Codec[Tree]:
        """Codec of one member of the batch."""
        return replace(self, batch=())

    @property
    def word(self) -> np.dtype[Any]:
        """The type of the words."""
        widest = max((np.dtype(dtype).itemsize for dtype in self.dtypes), default=4)
        return np.dtype(f"uint{8 * max(4, widest)}")

    def pack(self, tree: Tree) -> jax.Array:
        """Leaves end to end, batch axes last."""
        rows = []
        for leaf in jax.tree.leaves(tree):
            flat = jnp.reshape(as_words(leaf, self.word), (*self.batch, -1))
            rows.append(jnp.moveaxis(flat, -1, 0))
        return jnp.concatenate(rows)

    def unpack(self, packed: jax.Array) -> Tree:
        """The tree that `pack` was given; rows after its own are not looked at."""
        place, leaves = 0, []
        for shape, dtype in zip(self.shapes, self.dtypes, strict=True):
            size = int(np.prod(shape))
            part = jnp.moveaxis(packed[place : place + size], 0, -1)
            place += size
            leaves.append(jnp.reshape(_from_words(part, dtype), (*self.batch, *shape)))
        return jax.tree.unflatten(self.structure, leaves)


def as_words(leaf: jax.Array, word: np.dtype[Any]) -> jax.Array:
    """The bits of numbers as unsigned integers, filled up with zeros."""
    if leaf.dtype == bool:
        return leaf.astype(word)
    own = jnp.dtype(f"uint{8 * leaf.dtype.itemsize}")
    return jax.lax.bitcast_convert_type(leaf, own).astype(word)


def _from_words(words: jax.Array, dtype: str) -> jax.Array:
    if dtype == "bool":
        return words != 0
    own = jnp.dtype(f"uint{8 * jnp.dtype(dtype).itemsize}")
    return jax.lax.bitcast_convert_type(words.astype(own), jnp.dtype(dtype))
