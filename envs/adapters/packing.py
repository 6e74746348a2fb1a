"""Batches as single arrays: pytrees packed into words, shared parameters, key chains."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

if TYPE_CHECKING:
    from collections.abc import Hashable

    from jaxtyping import Array, Bool, Float, Integer

Tree = TypeVar("Tree")


class Shared:
    """Parameters that a whole batch shares, as constants of the compiled step.

    Equal ones, bit by bit, hash alike, so that a second environment of the same kind is compiled
    already; a constant costs nothing at each call, where passing these many small arrays costs as
    much as a step of a single environment.
    """

    def __init__(self, params: Any):
        leaves, self._structure = jax.tree.flatten(params)
        self._leaves = [np.asarray(leaf) for leaf in leaves]
        content = tuple((leaf.shape, str(leaf.dtype), leaf.tobytes()) for leaf in self._leaves)
        self._content = content, self._structure
        self._hash = hash(self._content)

    def params(self) -> Any:
        """The parameters themselves."""
        return jax.tree.unflatten(self._structure, map(jnp.asarray, self._leaves))

    def __reduce__(self) -> tuple[type[Shared], tuple[Any]]:
        """Without the hash, which is another one in another process."""
        return Shared, (jax.tree.unflatten(self._structure, self._leaves),)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Shared) and self._content == other._content


def split(chains: Integer[Array, "n words"]) -> tuple[Array, Array]:
    """The rest of every chain of keys (as plain numbers) and the key that is taken off it."""
    both = jax.vmap(lambda data: jax.random.split(jax.random.wrap_key_data(data)))(chains)
    return jax.vmap(jax.random.key_data)(both[:, 0]), both[:, 1]


def chosen(mask: Bool[Array, " n"], one: Tree, other: Tree) -> Tree:
    """Rows of one tree where the mask is true, of the other elsewhere."""

    def choose(a: Array, b: Array) -> Array:
        return jnp.where(mask.reshape(mask.shape + (1,) * (a.ndim - 1)), a, b)

    return jax.tree.map(choose, one, other)


def row_of(
    obs: Float[Array, " obs"],
    reward: Array,
    terminated: Array,
    truncated: Array,
    info: dict[str, Array],
) -> Float[Array, " numbers"]:
    """Results of a step as one array: observation, final observation, reward, the flags
    terminated, truncated and autoreset, info by its names."""
    rest = sorted(set(info) - {"final_obs", "autoreset"})
    numbers = [reward, terminated, truncated, info["autoreset"], *(info[name] for name in rest)]
    numbers = jnp.stack([number.astype(obs.dtype) for number in numbers])
    return jnp.concatenate([obs, info["final_obs"], numbers])


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
