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

from stickslip.envs.functional import pure_step

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.envs.functional import FunctionalEnv


class Results(NamedTuple):
    """One step of a batch of n environments; `info` has a column [n] for each entry."""

    obs: np.ndarray
    final_obs: np.ndarray
    reward: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray
    autoreset: np.ndarray
    info: dict[str, np.ndarray]


class PackedEnvs:
    """n environments of one kind, each with its own chain of random keys.

    Environment i starts its chain with `jax.random.key(seeds[i])`; every reset splits the chain and
    gives the second part to `FunctionalEnv.reset`. So one seed means one sequence of episodes,
    whatever the adapter and the size of the batch.
    """

    def __init__(self, env: FunctionalEnv, params: Any, num_envs: int, mapped: bool = False):
        """`mapped`: every leaf of params has a leading axis [num_envs]; else all share them."""
        self.env, self.num_envs = env, num_envs
        self.params = jax.tree.map(jnp.asarray, params)
        self._axis = 0 if mapped else None
        self._keys: Array | None = None
        self._states: Any = None
        key = jax.eval_shape(lambda: jax.random.key(0))
        one = jax.tree.map(lambda leaf: leaf[0], self.params) if mapped else self.params
        obs, state = jax.eval_shape(env.reset_env, key, one)
        self.dtype = np.dtype(obs.dtype)
        action = jax.ShapeDtypeStruct((len(env.action_names),), obs.dtype)
        info = jax.eval_shape(partial(pure_step, env), key, state, action, one)[5]
        self._names = sorted(set(info) - {"final_obs", "autoreset"})
        self._kinds = [np.dtype(info[name].dtype) for name in self._names]
        self._width = obs.shape[0]

    @property
    def states(self) -> Any:
        """The functional states, batched; None before the first reset."""
        return self._states

    def seed(self, seeds: list[int | None]) -> None:
        """Start the chain of every environment whose seed is not None."""
        if self._keys is None:
            self._keys = jax.vmap(jax.random.key)(jnp.zeros(self.num_envs, jnp.uint32))
        given = np.asarray([seed is not None for seed in seeds])
        numbers = np.asarray([0 if seed is None else seed % 2**32 for seed in seeds], np.uint32)
        self._keys = _reseed(self._keys, jnp.asarray(numbers), jnp.asarray(given))

    def reset(self, mask: np.ndarray | None = None) -> np.ndarray:
        """Begin new episodes, where `mask` is true if given; the observations [n, obs]."""
        if self._states is None:
            mask = None
        everyone = np.ones(self.num_envs, bool) if mask is None else mask
        before = (self._keys, self._states) if mask is not None else None
        self._keys, self._states, obs = _reset(
            self.env, self._axis, self._keys, self.params, everyone, before
        )
        return np.array(obs)

    def step(self, actions: np.ndarray) -> Results:
        """One control step of every environment; actions [n, act], checked already."""
        self._keys, self._states, packed = _step(
            self.env, self._axis, self._keys, self._states, actions, self.params
        )
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


@jax.jit
def _reseed(keys, numbers, given):
    return jax.vmap(lambda key, number, new: jnp.where(new, jax.random.key(number), key))(
        keys, numbers, given
    )


@partial(jax.jit, static_argnums=(0, 1))
def _reset(env: FunctionalEnv, axis: int | None, keys, params, mask, before):
    chains, subkeys = _split(keys)
    obs, states = jax.vmap(env.reset_env, (0, axis))(subkeys, params)
    if before is not None:
        chains, states = _where(mask, (chains, states), before)
    return chains, states, obs


@partial(jax.jit, static_argnums=(0, 1))
def _step(env: FunctionalEnv, axis: int | None, keys, states, actions, params):
    chains, subkeys = _split(keys)
    obs, states, reward, terminated, truncated, info = jax.vmap(
        partial(pure_step, env), (0, 0, 0, axis)
    )(subkeys, states, actions, params)
    keys = _where(info["autoreset"], chains, keys)
    rest = sorted(set(info) - {"final_obs", "autoreset"})
    columns = [reward, terminated, truncated, info["autoreset"], *(info[name] for name in rest)]
    columns = [column.astype(obs.dtype)[:, None] for column in columns]
    return keys, states, jnp.concatenate([obs, info["final_obs"], *columns], axis=1)


def _split(keys):
    both = jax.vmap(jax.random.split)(keys)
    return both[:, 0], both[:, 1]


def _where(mask, one, other):
    def choose(a, b):
        return jnp.where(mask.reshape(mask.shape + (1,) * (a.ndim - 1)), a, b)

    return jax.tree.map(choose, one, other)
