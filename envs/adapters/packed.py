"""A batch of functional environments behind plain NumPy arrays: what every adapter stands on.

One compiled call a step; its results come back in one array, which costs one copy instead of one
for each entry of info.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_memory, shown
from stickslip.envs.adapters.codec import Codec
from stickslip.envs.functional import pure_step

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jaxtyping import Array

    from stickslip.envs.functional import FunctionalEnv


MOST_ENVS = 2**31 - 1
"""In a batch: what an index of JAX's counts; memory refuses fewer."""
COPIES = 4
"""States and results of one step that exist at once, at least."""


class Results(NamedTuple):
    """One step of a batch of n environments; `info` has a column [n] for each entry."""

    obs: np.ndarray
    final_obs: np.ndarray
    reward: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray
    autoreset: np.ndarray
    info: dict[str, np.ndarray]


class _Shared:
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

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Shared) and self._content == other._content


class _Layout(NamedTuple):
    """What is static about a batch: hashable, the key of the compiled step."""

    env: FunctionalEnv
    shared: _Shared | None
    """None: every environment has parameters of its own, passed at each call."""
    carry: Codec
    """Of the key chains (as plain numbers) and the states."""

    def batched(self, params: Any) -> tuple[Any, int | None]:
        """The parameters and their axis for vmap."""
        return (params, 0) if self.shared is None else (self.shared.params(), None)


class PackedEnvs:
    """n environments of one kind, each with its own chain of random keys.

    Environment i starts its chain with `jax.random.key(seeds[i])`; every reset splits the chain and
    gives the second part to `FunctionalEnv.reset`. So one seed means one sequence of episodes,
    whatever the adapter and the size of the batch.
    """

    def __init__(self, env: FunctionalEnv, params: Any, num_envs: int, mapped: bool = False):
        """`mapped`: every leaf of params has a leading axis [num_envs]; else all share them."""
        self.env, self.num_envs = env, num_envs
        params = jax.tree.map(jnp.asarray, params)
        key = jax.eval_shape(lambda: jax.random.key(0))
        one = jax.tree.map(lambda leaf: leaf[0], params) if mapped else params
        obs, state = jax.eval_shape(env.reset_env, key, one)
        action = jax.ShapeDtypeStruct((len(env.action_names),), obs.dtype)
        info = jax.eval_shape(partial(pure_step, env), key, state, action, one)[5]
        data = jax.eval_shape(jax.random.key_data, key)
        many = jax.tree.map(
            lambda leaf: jax.ShapeDtypeStruct((num_envs, *leaf.shape), leaf.dtype), (data, state)
        )
        self.dtype = np.dtype(obs.dtype)
        each = sum(leaf.size * leaf.dtype.itemsize for leaf in jax.tree.leaves((state, info)))
        require_memory(f"num_envs = {shown(num_envs)}", "environments", num_envs, COPIES * each)
        shared = None if mapped else _Shared(params)
        self._layout = _Layout(env, shared, Codec.of(many, (num_envs,)))
        self._params = params if mapped else None
        self._carry: dict[str, Array] | None = None
        self._seeded: np.ndarray | None = None
        self._names = sorted(set(info) - {"final_obs", "autoreset"})
        self._kinds = [np.dtype(info[name].dtype) for name in self._names]
        self._width = obs.shape[0]

    @property
    def begun(self) -> bool:
        """Whether there has been a reset."""
        return self._carry is not None

    @property
    def states(self) -> Any:
        """The functional states, batched; None before the first reset."""
        return None if self._carry is None else _unpack(self._layout.carry, self._carry)[1]

    def seed(self, seeds: Sequence[int | None]) -> None:
        """Start the chain of every environment whose seed is not None; others keep theirs."""
        given = np.asarray([seed is not None for seed in seeds])
        numbers = np.asarray([0 if seed is None else seed % 2**32 for seed in seeds], np.uint32)
        self._seeded = np.where(given[:, None], np.asarray(_chains(numbers)), self._chains())

    def reset(self, mask: np.ndarray | None = None) -> np.ndarray:
        """Begin new episodes, where `mask` is true if given; the observations [n, obs]."""
        chains, self._seeded = self._chains(), None
        before = None if mask is None else self._carry
        everyone = np.ones(self.num_envs, bool) if mask is None else mask
        self._carry, obs = _reset(self._layout, chains, self._params, everyone, before)
        return np.array(obs)

    def step(self, actions: np.ndarray) -> Results:
        """One control step of every environment; actions [n, act], checked already."""
        self._carry, packed = _step(self._layout, self._carry, actions, self._params)
        table, width = np.array(packed), self._width
        flags = table[:, 2 * width + 1 : 2 * width + 4] != 0
        info = {
            name: table[:, 2 * width + 4 + column].astype(kind, copy=False)
            for column, (name, kind) in enumerate(zip(self._names, self._kinds, strict=True))
        }
        return Results(
            obs=table[:, :width].copy(),
            final_obs=table[:, width : 2 * width],
            reward=table[:, 2 * width],
            terminated=flags[:, 0],
            truncated=flags[:, 1],
            autoreset=flags[:, 2],
            info=info,
        )

    def _chains(self) -> np.ndarray:
        """Where every chain of keys stands: newly seeded, or as the steps left it."""
        if self._seeded is not None:
            return self._seeded
        if self._carry is None:
            return np.asarray(_chains(np.zeros(self.num_envs, np.uint32)))
        return np.asarray(_unpack(self._layout.carry, self._carry)[0])


@partial(jax.jit, static_argnums=0)
def _unpack(codec: Codec, packed):
    return codec.unpack(packed)


@jax.jit
def _chains(numbers):
    return jax.vmap(lambda number: jax.random.key_data(jax.random.key(number)))(numbers)


@partial(jax.jit, static_argnums=0)
def _reset(layout: _Layout, chains, params, mask, before):
    params, axis = layout.batched(params)
    after, subkeys = _split(chains)
    obs, states = jax.vmap(layout.env.reset_env, (0, axis))(subkeys, params)
    carry = after, states
    if before is not None:
        old = layout.carry.unpack(before)
        carry = _where(mask, carry, (chains, old[1]))
    return layout.carry.pack(carry), obs


@partial(jax.jit, static_argnums=0)
def _step(layout: _Layout, carry, actions, params):
    params, axis = layout.batched(params)
    chains, states = layout.carry.unpack(carry)
    after, subkeys = _split(chains)
    obs, states, reward, terminated, truncated, info = jax.vmap(
        partial(pure_step, layout.env), (0, 0, 0, axis)
    )(subkeys, states, actions, params)
    chains = _where(info["autoreset"], after, chains)
    rest = sorted(set(info) - {"final_obs", "autoreset"})
    columns = [reward, terminated, truncated, info["autoreset"], *(info[name] for name in rest)]
    columns = [column.astype(obs.dtype)[:, None] for column in columns]
    table = jnp.concatenate([obs, info["final_obs"], *columns], axis=1)
    return layout.carry.pack((chains, states)), table


def _split(chains):
    """The rest of every chain (as plain numbers) and the key that is taken off it."""
    both = jax.vmap(lambda data: jax.random.split(jax.random.wrap_key_data(data)))(chains)
    return jax.vmap(jax.random.key_data)(both[:, 0]), both[:, 1]


def _where(mask, one, other):
    def choose(a, b):
        return jnp.where(mask.reshape(mask.shape + (1,) * (a.ndim - 1)), a, b)

    return jax.tree.map(choose, one, other)
