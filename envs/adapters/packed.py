"""A batch of functional environments behind plain NumPy arrays, the base of every adapter.

One compiled call a step, of one array to one array: a call costs for each of them.
"""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_memory, shown
from stickslip.dynamics.kernels.fused import fused
from stickslip.dynamics.pytrees import rebuilt
from stickslip.envs.adapters.packing import Codec, Columns, Results, Shared, row_of
from stickslip.envs.functional import abstract_step, bare_step

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from jaxtyping import Array, Bool, Float, Integer

    from stickslip.envs.functional import FunctionalEnv


MOST_ENVS = 2**31 - 1
"""Most environments of a batch: the range of JAX's index; memory refuses fewer."""
COPIES = 4
"""States and results of one step that exist at once, at least."""


class _Program(NamedTuple):
    """Static part: hashable, the key of the compiled functions. Numbers of `entries` are passed at
    each call, all others are constants."""

    env: FunctionalEnv
    shared: Shared
    entries: tuple[str, ...]
    own: Codec
    """Codec of the entries."""
    carry: Codec
    """Codec of a key chain, as plain numbers, and a state."""
    numbers: int
    """Length of a row of `row_of`; it follows the carry, so that a step returns a single array."""

    def params(self, own: Array | None) -> Any:
        """One environment's parameters; own: its packed entries."""
        usual = self.shared.params()
        if own is None:
            return usual
        return rebuilt(usual, **dict(zip(self.entries, self.own.unpack(own), strict=True)))


class _Episodes:
    """Environments of a batch of n whose parameters differ from the shared ones in some entries.

    members: [n], true for those that are in here; columns of the others mean nothing.
    """

    def __init__(
        self, env: FunctionalEnv, shared: Shared, params: Any, entries: tuple[str, ...], n: int
    ):
        """params: of one episode, of which the structure counts."""
        data = jax.eval_shape(lambda: jax.random.key_data(jax.random.key(0)))
        obs, state, step = abstract_step(env, params)
        self.results = obs, *step[2:]
        """Shapes and types of a step's results."""
        self.columns, self.dtype = Columns(obs, step[5]), np.dtype(obs.dtype)
        own = Codec.of(tuple(getattr(params, name) for name in entries))
        carry = Codec.of((data, state))
        self.program = _Program(env, shared, entries, own, carry, self.columns.count)
        self.bytes = sum(leaf.size * leaf.dtype.itemsize for leaf in jax.tree.leaves(step[1:]))
        """Memory of one environment's state and results."""
        self.members = np.zeros(n, bool)
        self.carry: Array | None = None
        self._own: Array | None = None

    @cached_property
    def _step(self) -> Callable[..., Array]:
        return _step_of(self.program)

    def __getstate__(self) -> dict[str, Any]:
        """Without the compiled step, which does not pickle: a copy finds it again."""
        return {name: value for name, value in vars(self).items() if name != "_step"}

    def begin(self, chains: np.ndarray, mask: np.ndarray, params: Any) -> np.ndarray:
        """Begin episodes with these parameters where the mask is true; observations [n, obs]."""
        entries = tuple(getattr(params, name) for name in self.program.entries)
        before = None if self.carry is None or mask.all() else (self.carry, self._own)
        self.carry, self._own, obs = _begin(self.program, chains, entries, mask, before)
        return np.array(obs)

    def adopt(self, other: _Episodes, mask: np.ndarray) -> None:
        """Take over another group's episodes where the mask is true."""
        if self.carry is None or mask.all():
            self.carry = other.carry
        else:
            self.carry = jax.tree.map(partial(jnp.where, mask), other.carry, self.carry)

    def step(self, actions: np.ndarray) -> np.ndarray:
        """One control step: the rows of `row_of` [n, numbers]."""
        self.carry = self._step(self.carry, self._own, actions)
        words = np.array(np.asarray(self.carry)[-self.program.numbers :])
        own = np.dtype(f"uint{8 * self.dtype.itemsize}")
        return words.astype(own, copy=False).view(self.dtype).T

    def chains(self) -> np.ndarray:
        """The key chains [n, words], as plain numbers."""
        (size,) = self.program.carry.shapes[0]
        return np.asarray(self.carry)[:size].T.astype(self.program.carry.dtypes[0])


class PackedEnvs:
    """n environments of one kind, each with its own chain of random keys.

    Environment i starts its chain with `jax.random.key(seeds[i])`; every reset splits the chain and
    gives the second part to `FunctionalEnv.reset`. So one seed means one sequence of episodes,
    whatever the adapter and the size of the batch.
    """

    def __init__(self, env: FunctionalEnv, params: Any, num_envs: int):
        self.env, self.num_envs = env, num_envs
        params = jax.tree.map(jnp.asarray, params)
        self._shared = Shared(params)
        self._usual = _Episodes(env, self._shared, params, (), num_envs)
        self._usual.members[:] = True
        what = f"num_envs = {shown(num_envs)}"
        require_memory(what, "environments", num_envs, COPIES * self._usual.bytes)
        self.columns, self.dtype = self._usual.columns, self._usual.dtype
        self._others: dict[Any, _Episodes] = {}
        self._seeded: np.ndarray = np.array(_chains(np.zeros(num_envs, np.uint32)))
        self._pending = np.ones(num_envs, bool)
        self._ended = np.zeros(num_envs, bool)
        self._given: list[Any] = [None] * num_envs

    @property
    def _groups(self) -> list[_Episodes]:
        return [self._usual, *self._others.values()]

    @property
    def begun(self) -> bool:
        """True if there has been a reset."""
        return any(group.carry is not None for group in self._groups)

    def state_of(self, index: int) -> Any:
        """The functional state of an environment; after the first reset."""
        group = next(group for group in self._groups if group.members[index])
        return _state(group.program, np.asarray(group.carry)[:, index])

    def params_of(self, index: int) -> Any:
        """The parameters that an environment steps with, where its episode has its own, or None."""
        return self._given[index]

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

    def reset(self, mask: np.ndarray | None = None, params: Any = None) -> np.ndarray:
        """Begin new episodes, where `mask` is true if given; the observations [n, obs], which mean
        nothing elsewhere.

        params: of these episodes alone, as `FunctionalEnv.episode_params` makes them; None for
        those of the batch. ValueError where their steps would return something else.
        """
        mask = np.ones(self.num_envs, bool) if mask is None else mask
        params = None if params is None else jax.tree.map(jnp.asarray, params)
        group = None if params is None else self._group_for(params)
        chains = self._chains()
        if group is None:
            return self._begin_usual(chains, mask)
        if not (self.begun or mask.all()):
            self._begin_usual(chains, mask)
        obs = group.begin(chains, mask, params)
        if self._steps_alike(params):
            self._usual.adopt(group, mask)
            self._move(mask, self._usual)
        else:
            self._move(mask, group, params)
        return obs

    def _begin_usual(self, chains: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """Begin episodes with the batch's parameters; at first everywhere."""
        mask = mask if self.begun else np.ones(self.num_envs, bool)
        obs = self._usual.begin(chains, mask, None)
        self._move(mask, self._usual)
        return obs

    def step(self, actions: np.ndarray) -> Results:
        """One control step of every environment; actions [n, act], checked already."""
        return Results(self.rows(actions), self.columns)

    def rows(self, actions: np.ndarray) -> np.ndarray:
        """The same step as the rows of `row_of` [n, numbers], which `columns` reads."""
        if not self._others or self._usual.members.all():
            return self._usual.step(actions)
        table = np.zeros((self.num_envs, self.columns.count), self.dtype)
        for group in self._groups:
            if group.members.any():
                table = np.where(group.members[:, None], group.step(actions), table)
        self._reset_others(table)
        return table

    def _reset_others(self, table: np.ndarray) -> None:
        """Autoreset of episodes with other parameters: the usual ones follow."""
        width, flags = self.columns.width, self.columns.flags
        ends = ~self._usual.members & table[:, flags : flags + 2].any(axis=1)
        if self.env.autoreset == "same_step" and ends.any():
            table[ends, :width] = self.reset(ends)[ends]
            table[ends, flags + 2] = 1
        if self.env.autoreset == "next_step":
            over, self._ended = self._ended, ends & ~self._ended
            if over.any():
                obs = self.reset(over)[over]
                table[over] = 0
                table[over, : 2 * width] = np.tile(obs, 2)
                table[over, flags + 2] = 1

    def _move(self, mask: np.ndarray, group: _Episodes, params: Any = None) -> None:
        """Let one group step the environments where the mask is true."""
        self._pending &= ~mask
        self._ended &= ~mask
        for other in self._groups:
            other.members &= ~mask
        group.members |= mask
        if params is not None or any(one is not None for one in self._given):
            for index in map(int, np.flatnonzero(mask)):
                self._given[index] = params

    def _group_for(self, params: Any) -> _Episodes:
        """Group that steps episodes with parameters of this structure; it ends them without a
        reset. Options' entries are its own always, so that other numbers are the same program."""
        usual = self._shared.params()
        entries = tuple(
            one.name
            for one in fields(params)
            if one.name in self.env.episode_entries
            or Shared(getattr(params, one.name)) != Shared(getattr(usual, one.name))
        )
        own = _signature(tuple(getattr(params, name) for name in entries))
        if (entries, own) not in self._others:
            env = replace(self.env, autoreset="disabled")  # type: ignore[type-var]
            try:
                group = _Episodes(env, self._shared, params, entries, self.num_envs)
            except (TypeError, ValueError) as error:
                raise ValueError(
                    "options: such an episode cannot be stepped; accepted: the numbers of one "
                    "episode, not a batch"
                ) from error
            if _signature(group.results) != _signature(self._usual.results):
                raise ValueError(
                    "options: observation or info of such episodes would have other entries; "
                    "accepted: a scene or track that leaves them as they are"
                )
            self._others[entries, own] = group
        return self._others[entries, own]

    def _steps_alike(self, params: Any) -> bool:
        """True if the batch's own step does for these parameters, once an episode has begun."""
        usual = self.env.read_by_steps(self._shared.params())
        return Shared(usual) == Shared(self.env.read_by_steps(params))

    def _chains(self) -> np.ndarray:
        """Current key of each environment: newly seeded, or after the last step."""
        chains = self._seeded
        for group in self._groups:
            if group.carry is not None:
                where = group.members & ~self._pending
                chains = np.where(where[:, None], group.chains(), chains)
        return chains


def _signature(tree: object) -> tuple[Any, ...]:
    """Structure, shapes and types; hashable."""
    leaves, structure = jax.tree.flatten(tree)
    return structure, tuple((leaf.shape, str(leaf.dtype)) for leaf in leaves)


@jax.jit
def _chains(numbers: Integer[Array, " n"]) -> Integer[Array, "n words"]:
    return jax.vmap(lambda number: jax.random.key_data(jax.random.key(number)))(numbers)


@jax.jit
def _folded(
    chain: Integer[Array, " words"], number: Integer[Array, ""]
) -> Integer[Array, " words"]:
    return jax.random.key_data(jax.random.fold_in(jax.random.wrap_key_data(chain), number))


@partial(jax.jit, static_argnums=0)
def _state(program: _Program, words: Integer[Array, " words"]) -> Any:
    return program.carry.unpack(words)[1]


@partial(jax.jit, static_argnums=0)
def _begin(
    program: _Program,
    chains: Integer[Array, "n words"],
    entries: tuple[object, ...],
    mask: Bool[Array, " n"],
    before: tuple[Array, Array | None] | None,
) -> tuple[Array, Array | None, Float[Array, "n obs"]]:
    """Carry and own entries, packed with the environments last, and observations."""
    own = program.own.pack(entries) if entries else None
    params = program.params(own)

    def one(chain: Array) -> tuple[Array, Array]:
        both = jax.random.split(jax.random.wrap_key_data(chain))
        obs, state = program.env.reset_env(both[1], params)
        packed = program.carry.pack((jax.random.key_data(both[0]), state))
        return jnp.concatenate([packed, jnp.zeros(program.numbers, packed.dtype)]), obs

    carry, obs = jax.vmap(one, out_axes=(-1, 0))(chains)
    own = None if own is None else jnp.broadcast_to(own[:, None], (len(own), len(mask)))
    if before is not None:
        carry, own = jax.tree.map(partial(jnp.where, mask), (carry, own), before)
    return carry, own, obs


@lru_cache(maxsize=64)
def _step_of(program: _Program) -> Callable[..., Array]:
    """The compiled step: carry, own entries, or None, and actions to the carry."""

    def step(carry: Array, own: Array | None, actions: Float[Array, "n act"]) -> Array:
        axis = None if own is None else -1
        return jax.vmap(partial(_step_one, program), (-1, axis, 0), -1)(carry, own, actions)

    return jax.jit(step)


@partial(fused, fixed=1)
def _step_one(
    program: _Program,
    carry: Integer[Array, " words"],
    own: Integer[Array, " own"] | None,
    action: Float[Array, " act"],
) -> Integer[Array, " words"]:
    """One environment's step; carry: its packed column, its row of `row_of` at the end."""
    chain, state = program.carry.unpack(carry)
    after, subkey = jax.random.split(jax.random.wrap_key_data(chain))
    obs, state, reward, terminated, truncated, info = bare_step(
        program.env, subkey, state, action, program.params(own)
    )
    chain = jnp.where(info["autoreset"], jax.random.key_data(after), chain)
    row = program.carry.words(row_of(obs, reward, terminated, truncated, info))
    return jnp.concatenate([program.carry.pack((chain, state)), row])
