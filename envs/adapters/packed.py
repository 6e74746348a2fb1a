"""A batch of functional environments behind plain NumPy arrays, the base of every adapter.

One compiled call a step, of one array to one array, since a call costs for each of them: shared
parameters are constants, pytrees words, results of a step rows.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_memory, shown
from stickslip.dynamics.kernels.fused import fused
from stickslip.dynamics.status import Status
from stickslip.envs.functional import FunctionalEnv, abstract_step, bare_step

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Integer


MOST_ENVS = 2**31 - 1
"""Most environments of a batch: the range of JAX's index; memory refuses fewer."""
MOST_SEED = 2**64 - 1
"""Greatest seed; beyond the 2^32 of JAX's random keys they count modulo 2^32."""
COPIES = 4
"""States and results of one step that exist at once, at least."""

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
            bits, kind = words[place : place + size], jnp.dtype(dtype)
            own = bits.astype(f"uint{8 * kind.itemsize}")
            leaf = bits != 0 if kind.kind == "b" else jax.lax.bitcast_convert_type(own, kind)
            leaves.append(jnp.reshape(leaf, shape))
            place += size
        return jax.tree.unflatten(self.structure, leaves)


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
        names = sorted({*info} - {"final_obs", "autoreset"})
        self.kinds = {name: np.dtype(info[name].dtype) for name in names}
        """Types of info's entries."""
        self.flags = 2 * self.width + 1
        """Column of terminated, which truncated and autoreset follow."""
        self.info = self.flags + 3
        """Column of info's first entry."""
        self.count = self.info + len(self.kinds)
        """Numbers of a row."""
        own = {"b": bool, "i": int, "u": int}
        self._whole = [(name, own[of.kind]) for name, of in self.kinds.items() if of.kind in own]

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


class _Program(NamedTuple):
    """Static part: hashable, the key of the compiled functions."""

    env: FunctionalEnv
    shared: Shared
    carry: Codec
    """Codec of a key chain, as plain numbers, and a state."""
    numbers: int
    """Length of a row of `row_of`; it follows the carry, so that a step returns a single array."""


class PackedEnvs:
    """n environments of one kind, each with its own chain of random keys.

    Environment i starts its chain with `jax.random.key(seeds[i])`; every reset splits the chain and
    gives the second part to `FunctionalEnv.reset`. So one seed means one sequence of episodes,
    whatever the adapter and the size of the batch.
    """

    def __init__(self, env: FunctionalEnv, params: Any, num_envs: int):
        self.env, self.num_envs = env, num_envs
        self.params = jax.tree.map(jnp.asarray, params)
        """The parameters that all environments step with."""
        obs, state, step = abstract_step(env, self.params)
        self.columns, self.dtype = Columns(obs, step[5]), np.dtype(obs.dtype)
        leaves = jax.tree.leaves((state, step[2:]))
        each = sum(leaf.size * leaf.dtype.itemsize for leaf in leaves)
        what = f"num_envs = {shown(num_envs)}"
        require_memory(what, "environments", num_envs, COPIES * each)
        chain = jax.eval_shape(lambda: jax.random.key_data(jax.random.key(0)))
        carry = Codec.of((chain, state))
        self._program = _Program(env, Shared(self.params), carry, self.columns.count)
        self._carry: Array | None = None
        self.last: Results | None = None
        """Results of the last step, None after a reset of all."""
        self._seeded: np.ndarray = np.array(_chains(np.zeros(num_envs, np.uint32)))
        self._pending = np.ones(num_envs, bool)

    @cached_property
    def _step(self) -> Callable[..., Array]:
        """The compiled step."""
        return _step_of(self._program)

    def __getstate__(self) -> dict[str, Any]:
        """Without the compiled step, which does not pickle: a copy finds it again."""
        return {name: value for name, value in vars(self).items() if name != "_step"}

    @property
    def begun(self) -> bool:
        """True if there has been a reset."""
        return self._carry is not None

    def state_of(self, index: int) -> Any:
        """The functional state of an environment; after the first reset."""
        return _state(self._program, np.asarray(self._carry)[:, index])

    def seed(self, seeds: Sequence[int | None]) -> None:
        """Start the chain of every environment whose seed is not None; others keep theirs."""
        given = np.asarray([seed is not None for seed in seeds])
        new = np.array(_chains(np.asarray([(seed or 0) % 2**32 for seed in seeds], np.uint32)))
        self._seeded = np.where(given[:, None], new, self._seeded)
        self._pending |= given

    def reset(self, mask: np.ndarray | None = None, params: Any = None) -> np.ndarray:
        """Begin episodes where the mask [n] is true, by default and at first everywhere; the
        observations [n, obs], 0 elsewhere.

        params: those that the episodes start with, as `FunctionalEnv.episode_params` makes them;
        None for the usual ones. ValueError where they are no parameters of one episode.
        """
        wanted = np.ones(self.num_envs, bool)
        if mask is not None and not mask.all():
            if not self.begun:
                return np.where(mask[:, None], self.reset(params=params), 0)
            wanted = mask
        before = None if wanted.all() else self._carry
        self._carry, obs = _begin(self._program, self._chains(), params, wanted, before)
        self._pending &= ~wanted
        if wanted.all():
            self.last = None
        elif self.last is not None:
            self.last.autoreset[wanted] = True  # their infos are of the episode before
        return np.where(wanted[:, None], obs, 0)

    def step(self, actions: np.ndarray) -> Results:
        """One control step of every environment; actions [n, act], checked already."""
        self.last = Results(self.rows(actions), self.columns)
        return self.last

    def rows(self, actions: np.ndarray) -> np.ndarray:
        """The same step as the rows of `row_of` [n, numbers], which `columns` reads."""
        self._carry = self._step(self._carry, actions)
        words = np.array(np.asarray(self._carry)[-self.columns.count :])
        own = np.dtype(f"uint{8 * self.dtype.itemsize}")
        return words.astype(own, copy=False).view(self.dtype).T

    def _chains(self) -> np.ndarray:
        """Current key of each environment [n, words]: newly seeded, or after the last step."""
        if self._carry is None:
            return self._seeded
        carry = self._program.carry
        own = np.asarray(self._carry)[: carry.shapes[0][0]].T.astype(carry.dtypes[0])
        return np.where(self._pending[:, None], self._seeded, own)


_chains = jax.jit(jax.vmap(lambda number: jax.random.key_data(jax.random.key(number))))


@partial(jax.jit, static_argnums=0)
def _state(program: _Program, words: Integer[Array, " words"]) -> Any:
    return program.carry.unpack(words)[1]


@partial(jax.jit, static_argnums=0)
def _begin(
    program: _Program,
    chains: Integer[Array, "n words"],
    params: Any,
    mask: Bool[Array, " n"],
    before: Integer[Array, "words n"] | None,
) -> tuple[Integer[Array, "words n"], Float[Array, "n obs"]]:
    """Carry, packed with the environments last, and observations. params: None for the shared
    ones; before: carry of the environments that go on, outside the mask."""
    params = program.shared.params() if params is None else params

    def one(chain: Array) -> tuple[Array, Array]:
        both = jax.random.split(jax.random.wrap_key_data(chain))
        obs, state = program.env.reset_env(both[1], params)
        packed = program.carry.pack((jax.random.key_data(both[0]), state))
        return jnp.concatenate([packed, jnp.zeros(program.numbers, packed.dtype)]), obs

    carry, obs = jax.vmap(one, out_axes=(-1, 0))(chains)
    return carry if before is None else jnp.where(mask, carry, before), obs


@lru_cache(maxsize=64)
def _step_of(program: _Program) -> Callable[..., Array]:
    """The compiled step: carry and actions [n, act] to the carry."""
    return jax.jit(jax.vmap(partial(_step_one, program), (-1, 0), -1))


@partial(fused, fixed=1)
def _step_one(
    program: _Program, carry: Integer[Array, " words"], action: Float[Array, " act"]
) -> Integer[Array, " words"]:
    """One environment's step; carry: its packed column, its row of `row_of` at the end."""
    chain, state = program.carry.unpack(carry)
    after, subkey = jax.random.split(jax.random.wrap_key_data(chain))
    obs, state, reward, terminated, truncated, info = bare_step(
        program.env, subkey, state, action, program.shared.params()
    )
    chain = jnp.where(info["autoreset"], jax.random.key_data(after), chain)
    row = program.carry.words(row_of(obs, reward, terminated, truncated, info))
    return jnp.concatenate([program.carry.pack((chain, state)), row])
