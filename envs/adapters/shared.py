"""Functions shared by the compiled programs of a batch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

if TYPE_CHECKING:
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
