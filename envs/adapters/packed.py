"""A batch of functional environments behind plain NumPy arrays, the base of every adapter.

One compiled call a step, of one array to one array: a call costs for each of them.
"""

from __future__ import annotations

from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_memory, shown
from stickslip.dynamics.compilation import moves_numbers
from stickslip.dynamics.kernels.fused import fused
from stickslip.envs.adapters.packing import Codec, Shared, as_words, chosen, row_of, split
from stickslip.envs.adapters.results import Columns, Results
from stickslip.envs.adapters.separate import SeparateEpisodes, kind_of, signature_of, unpack
from stickslip.envs.functional import bare_step

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from jaxtyping import Array, Bool, Float, Integer

    from stickslip.envs.functional import FunctionalEnv


MOST_ENVS = 2**31 - 1
"""Most environments of a batch: the range of JAX's index; memory refuses fewer."""
COPIES = 4
"""States and results of one step that exist at once, at least."""


class _Layout(NamedTuple):
    """Static part of a batch: hashable, the key of the compiled step."""

    env: FunctionalEnv
    shared: Shared | None
    """None: every environment has parameters of its own, passed at each call."""
    carry: Codec
    """Codec of the key chains (as plain numbers) and the states."""
    numbers: int
    """Length of a row of `row_of`; it follows the carry, so that a step returns a single array."""

    def batched(self, params: Any) -> tuple[Any, int | None]:
        """The parameters and their axis for vmap."""
        return (params, 0) if self.shared is None else (self.shared.params(), None)


class PackedEnvs:
    """n environments of one kind, each with its own chain of random keys.

    Environment i starts its chain with `jax.random.key(seeds[i])`; every reset splits the chain and
    gives the second part to `FunctionalEnv.reset`. So one seed means one sequence of episodes,
    whatever the adapter and the size of the batch.
    """

    @moves_numbers
    def __init__(self, env: FunctionalEnv, params: Any, num_envs: int, mapped: bool = False):
        """`mapped`: every leaf of params has a leading axis [num_envs]; else all share them."""
        self.env, self.num_envs = env, num_envs
        params = jax.tree.map(jnp.asarray, params)
        key = jax.eval_shape(lambda: jax.random.key(0))
        one = jax.tree.map(lambda leaf: leaf[0], params) if mapped else params
        obs, state = jax.eval_shape(env.reset_env, key, one)
        action = jax.ShapeDtypeStruct((len(env.action_names),), obs.dtype)
        step = jax.eval_shape(partial(bare_step, env), key, state, action, one)
        info, self._signature = step[5], signature_of((obs, *step[2:]))
        data = jax.eval_shape(jax.random.key_data, key)
        many = jax.tree.map(
            lambda leaf: jax.ShapeDtypeStruct((num_envs, *leaf.shape), leaf.dtype), (data, state)
        )
        self.dtype = np.dtype(obs.dtype)
        each = sum(leaf.size * leaf.dtype.itemsize for leaf in jax.tree.leaves((state, info)))
        require_memory(f"num_envs = {shown(num_envs)}", "environments", num_envs, COPIES * each)
        shared = None if mapped else Shared(params)
        self.columns = Columns(obs, info)
        self._layout = _Layout(env, shared, Codec.of(many, (num_envs,)), self.columns.count)
        self._params = params if mapped else None
        self._carry: Array | None = None
        self._seeded = np.zeros((num_envs, *data.shape), data.dtype)
        self._pending = np.zeros(num_envs, bool)
        self._groups: dict[Any, SeparateEpisodes] = {}
        self._separate = np.zeros(num_envs, bool)
        self._ended = np.zeros(num_envs, bool)
        self._given: list[Any] = [None] * num_envs

    @cached_property
    def _step(self) -> Callable[..., Array]:
        return _step_of(self._layout)

    def __getstate__(self) -> dict[str, Any]:
        """Without the compiled step, which does not pickle: a copy finds it again."""
        return {name: value for name, value in vars(self).items() if name != "_step"}

    @property
    def begun(self) -> bool:
        """True if there has been a reset."""
        return self._carry is not None or bool(self._separate.any())

    @moves_numbers
    def state_of(self, index: int) -> Any:
        """The functional state of an environment; after the first reset."""
        groups = (group for group in self._groups.values() if group.members[index])
        group = next(groups, None)
        states = (self if group is None else group).unpacked()[1]
        return jax.tree.map(lambda leaf: leaf[index], states)

    def params_of(self, index: int) -> Any:
        """The parameters that an environment steps with, where its episode has its own, or None."""
        return self._given[index]

    @moves_numbers
    def seed(self, seeds: Sequence[int | None]) -> None:
        """Start the chain of every environment whose seed is not None; others keep theirs.

        A seed >= 0 of any size, every bit of which counts: a key takes the lowest 32, the others
        are folded in.
        """
        given = np.asarray([seed is not None for seed in seeds])
        numbers = np.asarray([0 if seed is None else seed % 2**32 for seed in seeds], np.uint32)
        new = np.array(_chains(numbers))
        for index, seed in enumerate(seeds):
            rest = 0 if seed is None else seed >> 32
            while rest > 0:
                new[index] = _folded(new[index], np.uint32(rest % 2**32))
                rest >>= 32
        self._seeded = np.where(given[:, None], new, self._seeded)
        self._pending |= given

    @moves_numbers
    def reset(self, mask: np.ndarray | None = None, params: Any = None) -> np.ndarray:
        """Begin new episodes, where `mask` is true if given; the observations [n, obs], which mean
        nothing elsewhere.

        params: of these episodes alone, as `FunctionalEnv.episode_params` makes them; None for
        those of the batch. ValueError where their steps would return something else.
        """
        chains, begun, everyone = self._chains(), self.begun, np.ones(self.num_envs, bool)
        mask = everyone if mask is None else mask
        params = None if params is None else jax.tree.map(jnp.asarray, params)
        group = None if params is None else self._group_for(params)
        self._pending &= ~(mask if begun else everyone)
        if group is None:
            return self._begin(chains, mask if begun else everyone)
        if not (begun or mask.all()):
            self._begin(chains, everyone)
        carry, obs = group.begin(chains, mask, params)
        self._leave(mask)
        if self._steps_alike(params):
            room = jnp.zeros((self._layout.numbers, self.num_envs), carry.dtype)
            carry = jnp.concatenate([carry, room])
            if self._carry is not None and not mask.all():
                carry = jnp.where(mask, carry, self._carry)
            self._carry = carry
        else:
            group.members |= mask
            self._separate |= mask
            for index in map(int, np.flatnonzero(mask)):
                self._given[index] = params
        return obs

    def step(self, actions: np.ndarray) -> Results:
        """One control step of every environment; actions [n, act], checked already."""
        return Results(self.rows(actions), self.columns)

    @moves_numbers
    def rows(self, actions: np.ndarray) -> np.ndarray:
        """The same step as the rows of `row_of` [n, numbers], which `columns` reads."""
        if not (self._groups and self._separate.any()):
            return self._stepped_together(actions)
        table = np.zeros((self.num_envs, self._layout.numbers), self.dtype)
        if not self._separate.all():
            table = self._stepped_together(actions)
        for group in self._groups.values():
            if group.members.any():
                table = np.where(group.members[:, None], group.step(actions), table)
        self._reset_separate(table)
        return table

    def _stepped_together(self, actions: np.ndarray) -> np.ndarray:
        """The rows of `row_of`, in the batch's own step."""
        self._carry = self._step(self._carry, actions, self._params)
        words = np.array(np.asarray(self._carry)[-self._layout.numbers :])
        own = np.dtype(f"uint{8 * self.dtype.itemsize}")
        return words.astype(own, copy=False).view(self.dtype).T

    def _reset_separate(self, table: np.ndarray) -> None:
        """Autoreset of separate environments, which continue with the batch's parameters."""
        width = self.columns.width
        autoreset = 2 * width + 3
        ends = self._separate & table[:, autoreset - 2 : autoreset].any(axis=1)
        if self.env.autoreset == "same_step" and ends.any():
            table[ends, :width] = self.reset(ends)[ends]
            table[ends, autoreset] = 1
        if self.env.autoreset == "next_step":
            over, self._ended = self._ended, ends & ~self._ended
            if over.any():
                obs = self.reset(over)[over]
                table[over] = 0
                table[over, : 2 * width] = np.tile(obs, 2)
                table[over, autoreset] = 1

    def _begin(self, chains: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """Episodes with the batch's own parameters."""
        before = None if mask.all() else self._carry
        self._carry, obs = _reset(self._layout, chains, self._params, mask, before)
        self._leave(mask)
        return np.array(obs)

    def _leave(self, mask: np.ndarray) -> None:
        """End the separate episodes where the mask is true."""
        self._separate &= ~mask
        self._ended &= ~mask
        for group in self._groups.values():
            group.members &= ~mask
        for index in map(int, np.flatnonzero(mask)) if any(self._given) else ():
            self._given[index] = None

    def _group_for(self, params: Any) -> SeparateEpisodes:
        """Group that steps episodes with parameters of this structure."""
        shared = self._layout.shared
        if shared is None:
            raise ValueError("options beside parameters of every environment's own; accepted: none")
        usual = shared.params()
        key = kind_of(self.env, usual, params)
        if key not in self._groups:
            try:
                group = SeparateEpisodes(self.env, usual, params, self.num_envs)
            except (TypeError, ValueError) as error:
                raise ValueError(
                    "options: such an episode cannot be stepped; accepted: the numbers of one "
                    "episode, not a batch"
                ) from error
            if group.signature != self._signature:
                raise ValueError(
                    "options: observation or info of such episodes would have other entries; "
                    "accepted: a scene or track that leaves them as they are"
                )
            self._groups[key] = group
        return self._groups[key]

    def _steps_alike(self, params: Any) -> bool:
        """True if the batch's own step does for these parameters, once an episode has begun."""
        shared = self._layout.shared
        usual = None if shared is None else self.env.read_by_steps(shared.params())
        return Shared(usual) == Shared(self.env.read_by_steps(params))

    def unpacked(self) -> Any:
        """The chains and the states of the batch's own carry."""
        return unpack(self._layout.carry, self._carry)

    def _chains(self) -> np.ndarray:
        """Current key of each environment: newly seeded, or after the last step."""
        if self._carry is None:
            chains = np.asarray(_chains(np.zeros(self.num_envs, np.uint32)))
        else:
            chains = np.asarray(self.unpacked()[0])
        for group in self._groups.values():
            if group.members.any():
                own = np.asarray(group.unpacked()[0])
                chains = np.where(group.members[:, None], own, chains)
        return np.where(self._pending[:, None], self._seeded, chains)


@jax.jit
def _chains(numbers: Integer[Array, " n"]) -> Integer[Array, "n words"]:
    return jax.vmap(lambda number: jax.random.key_data(jax.random.key(number)))(numbers)


@jax.jit
def _folded(
    chain: Integer[Array, " words"], number: Integer[Array, ""]
) -> Integer[Array, " words"]:
    return jax.random.key_data(jax.random.fold_in(jax.random.wrap_key_data(chain), number))


@partial(jax.jit, static_argnums=0)
def _reset(
    layout: _Layout,
    chains: Integer[Array, "n words"],
    params: object,
    mask: Bool[Array, " n"],
    before: Array | None,
) -> tuple[Array, Float[Array, "n obs"]]:
    params, axis = layout.batched(params)
    after, subkeys = split(chains)
    obs, states = jax.vmap(layout.env.reset_env, (0, axis))(subkeys, params)
    carry = after, states
    if before is not None:
        old = layout.carry.unpack(before)
        carry = chosen(mask, carry, (chains, old[1]))
    packed = layout.carry.pack(carry)
    room = jnp.zeros((layout.numbers, packed.shape[1]), packed.dtype)
    return jnp.concatenate([packed, room]), obs


@lru_cache(maxsize=64)
def _step_of(layout: _Layout) -> Callable[..., Array]:
    """The compiled step of a layout: carry, actions and own parameters, or None, to the carry."""

    def step(carry: Array, actions: Float[Array, "n act"], params: object) -> Array:
        axis = None if params is None else 0
        return jax.vmap(partial(_step_one, layout), (-1, 0, axis), -1)(carry, actions, params)

    return jax.jit(step)


@partial(fused, fixed=1)
def _step_one(
    layout: _Layout, carry: Integer[Array, " words"], action: Float[Array, " act"], params: object
) -> Integer[Array, " words"]:
    """One environment's step; carry: its packed column, its row of `row_of` at the end."""
    codec, shared = layout.carry.of_one, layout.shared
    params = params if shared is None else shared.params()
    chain, state = codec.unpack(carry)
    after, subkey = jax.random.split(jax.random.wrap_key_data(chain))
    obs, state, reward, terminated, truncated, info = bare_step(
        layout.env, subkey, state, action, params
    )
    chain = jnp.where(info["autoreset"], jax.random.key_data(after), chain)
    row = as_words(row_of(obs, reward, terminated, truncated, info), codec.word)
    return jnp.concatenate([codec.pack((chain, state)), row])
