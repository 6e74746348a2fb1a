"""A batch as few arrays: shared parameters, pytrees as words, results of a step as rows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping

    from jaxtyping import Array, Float

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


@dataclass(frozen=True)
class Codec(Generic[Tree]):
    """The layout of one pytree, from `Codec.of` its abstract values; static and hashable.

    `pack` gives the leaves' bits as unsigned integers [words], `unpack` the tree. A word is as wide
    as the widest leaf's numbers, 4 bytes at least.
    """

    structure: Hashable
    shapes: tuple[tuple[int, ...], ...]
    dtypes: tuple[str, ...]

    @classmethod
    def of(cls, tree: Tree) -> Codec[Tree]:
        """The layout of `tree`, whose leaves are arrays or abstract arrays."""
        leaves, structure = jax.tree.flatten(tree)
        shapes = tuple(tuple(leaf.shape) for leaf in leaves)
        return cls(structure, shapes, tuple(str(leaf.dtype) for leaf in leaves))

    @property
    def word(self) -> np.dtype[Any]:
        """The type of the words."""
        widest = max((np.dtype(dtype).itemsize for dtype in self.dtypes), default=4)
        return np.dtype(f"uint{8 * max(4, widest)}")

    def pack(self, tree: Tree) -> jax.Array:
        """Leaves end to end."""
        return jnp.concatenate([jnp.ravel(self.words(leaf)) for leaf in jax.tree.leaves(tree)])

    def words(self, leaf: jax.Array) -> jax.Array:
        """The bits of numbers, filled up with zeros."""
        if leaf.dtype == bool:
            return leaf.astype(self.word)
        own = jnp.dtype(f"uint{8 * leaf.dtype.itemsize}")
        return jax.lax.bitcast_convert_type(leaf, own).astype(self.word)

    def unpack(self, words: jax.Array) -> Tree:
        """The tree that `pack` was given; what follows its own words is not read."""
        place, leaves = 0, []
        for shape, dtype in zip(self.shapes, self.dtypes, strict=True):
            size = int(np.prod(shape))
            leaf = _from_words(words[place : place + size], dtype)
            leaves.append(jnp.reshape(leaf, shape))
            place += size
        return jax.tree.unflatten(self.structure, leaves)


def _from_words(words: jax.Array, dtype: str) -> jax.Array:
    if dtype == "bool":
        return words != 0
    own = jnp.dtype(f"uint{8 * jnp.dtype(dtype).itemsize}")
    return jax.lax.bitcast_convert_type(words.astype(own), jnp.dtype(dtype))


def row_of(
    obs: Float[Array, " obs"],
    reward: Array,
    terminated: Array,
    truncated: Array,
    info: dict[str, Array],
) -> Float[Array, " numbers"]:
    """Results of a step as one array: observation, final observation, reward, the flags
    terminated, truncated and autoreset, info by its names. `Columns` reads it."""
    rest = sorted(set(info) - {"final_obs", "autoreset"})
    numbers = [reward, terminated, truncated, info["autoreset"], *(info[name] for name in rest)]
    numbers = jnp.stack([number.astype(obs.dtype) for number in numbers])
    return jnp.concatenate([obs, info["final_obs"], numbers])


class Columns:
    """Columns of `row_of`, from the shapes and types of one environment's results."""

    def __init__(self, obs: Array, info: dict[str, Array]):
        self.width = obs.shape[0]
        """Numbers of an observation."""
        self.kinds = {
            name: np.dtype(info[name].dtype)
            for name in sorted({*info} - {"final_obs", "autoreset"})
        }
        """Types of info's entries."""
        self.flags = 2 * self.width + 1
        """Column of terminated, which truncated and autoreset follow."""
        self.info = self.flags + 3
        """Column of info's first entry."""
        self.count = self.info + len(self.kinds)
        """Numbers of a row."""
        self._whole = [
            (name, bool if kind.kind == "b" else int)
            for name, kind in self.kinds.items()
            if kind.kind != "f"
        ]

    def info_of(self, row: np.ndarray) -> dict[str, float]:
        """Info of one environment, in Python's numbers."""
        info: dict[str, float] = dict(zip(self.kinds, row[self.info :].tolist(), strict=True))
        for name, kind in self._whole:
            info[name] = kind(info[name])
        return info


class Results:
    """One step of a batch of n environments, from the rows of `row_of` [n, numbers].

    reward, terminated, truncated, autoreset: [n]; what else there is, when it is asked for.
    """

    def __init__(self, table: np.ndarray, columns: Columns):
        self._table, self._columns = table, columns
        self.reward = table[:, columns.flags - 1]
        flags = table[:, columns.flags : columns.info] != 0
        self.terminated, self.truncated, self.autoreset = flags.T

    @property
    def obs(self) -> np.ndarray:
        """[n, obs], float32"""
        return self._table[:, : self._columns.width].astype(np.float32)

    @property
    def final_obs(self) -> np.ndarray:
        """[n, obs], float32"""
        return self._table[:, self._columns.width : 2 * self._columns.width].astype(np.float32)

    @cached_property
    def info(self) -> dict[str, np.ndarray]:
        """A column [n] for each entry."""
        columns = self._table.T[self._columns.info :]
        return {
            name: column.astype(kind, copy=False)
            for column, (name, kind) in zip(columns, self._columns.kinds.items(), strict=True)
        }

    def info_of(self, index: int) -> dict[str, float]:
        """Info of one environment, in Python's numbers."""
        return self._columns.info_of(self._table[index])


def ending(info: Mapping[str, float], terminated: bool) -> str:
    """Description of an episode's end; info: of its last step."""
    how = "terminated" if terminated else "truncated"
    count = info.get("episode_length")
    length = "" if count is None else f" after {count} step{'' if count == 1 else 's'}"
    status = f", status {Status(int(info['status'])).name}" if "status" in info else ""
    return how + length + status
