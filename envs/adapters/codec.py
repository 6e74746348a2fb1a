"""A pytree of many small arrays as a few large ones: a compiled call costs per array."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Generic, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

Tree = TypeVar("Tree")


@dataclass(frozen=True)
class Codec(Generic[Tree]):
    """The layout of one pytree, from `Codec.of` its abstract values; static and hashable.

    `pack` gives one array [total size, *batch] for each dtype among the leaves, `unpack` the tree.
    batch: the shape that all leaves begin with.
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

    def pack(self, tree: Tree) -> dict[str, jax.Array]:
        """Leaves of one dtype end to end, batch axes last."""
        rows: dict[str, list[jax.Array]] = {}
        for leaf, dtype in zip(jax.tree.leaves(tree), self.dtypes, strict=True):
            flat = jnp.reshape(leaf, (*self.batch, -1))
            rows.setdefault(dtype, []).append(jnp.moveaxis(flat, -1, 0))
        return {dtype: jnp.concatenate(parts) for dtype, parts in rows.items()}

    def unpack(self, packed: dict[str, jax.Array]) -> Tree:
        """The tree that `pack` was given."""
        place = dict.fromkeys(packed, 0)
        leaves = []
        for shape, dtype in zip(self.shapes, self.dtypes, strict=True):
            size = int(np.prod(shape))
            part = packed[dtype][place[dtype] : place[dtype] + size]
            place[dtype] += size
            leaves.append(jnp.reshape(jnp.moveaxis(part, 0, -1), (*self.batch, *shape)))
        return jax.tree.unflatten(self.structure, leaves)
