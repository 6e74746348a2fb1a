"""Environments of a batch that are in episodes with parameters of their own."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.kernels.fused import fused
from stickslip.dynamics.pytrees import rebuilt
from stickslip.envs.adapters.packing import Codec, Shared, Tree, row_of, split
from stickslip.envs.functional import Params, bare_step

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Integer

    from stickslip.envs.functional import FunctionalEnv


class _Program(NamedTuple):
    """Static part: hashable, the key of the compiled functions. The numbers of `entries` are
    passed at each call, those of all others are constants, as in the batch's own step."""

    env: FunctionalEnv
    shared: Shared
    entries: tuple[str, ...]
    own: Codec
    """Codec of the entries, one of each for every environment."""
    carry: Codec
    """Codec of the key chains (as plain numbers) and the states."""

    def params(self, own: tuple[object, ...]) -> Any:
        """One environment's parameters."""
        return rebuilt(self.shared.params(), **dict(zip(self.entries, own, strict=True)))


def _entries(env: FunctionalEnv, params: Any, other: Any) -> tuple[str, ...]:
    """The entries that an episode's parameters have of their own: those that options may change,
    so that other numbers are the same program, and whatever else is different."""
    names = [one.name for one in fields(params)]
    return tuple(
        name
        for name in names
        if name in env.episode_entries
        or Shared(getattr(params, name)) != Shared(getattr(other, name))
    )


def kind_of(
    env: FunctionalEnv[Any, Params], params: Params, other: Params
) -> tuple[tuple[str, ...], Signature]:
    """Key of the episodes that one `SeparateEpisodes` steps; hashable."""
    entries = _entries(env, params, other)
    return entries, signature_of(tuple(getattr(other, name) for name in entries))


Signature: TypeAlias = tuple[Hashable, tuple[tuple[tuple[int, ...], str], ...]]
"""Structure of a pytree, and shape and type of each leaf."""


class SeparateEpisodes(Generic[Params]):
    """Those environments of a batch of n whose episodes have parameters of one structure.

    Their numbers are their own, so that other numbers compile nothing. They end without a reset:
    whoever steps them resets them, with the parameters of the batch. members: [n], true for those
    that are in here; the rows of the others mean nothing.
    """

    def __init__(
        self, env: FunctionalEnv[Any, Params], params: Params, other: Params, num_envs: int
    ):
        """params: of the batch; other: of an episode, of which the structure counts here."""
        self.env = replace(env, autoreset="disabled")  # type: ignore[type-var]
        entries = _entries(env, params, other)
        key = jax.eval_shape(lambda: jax.random.key(0))
        data = jax.eval_shape(jax.random.key_data, key)
        obs, state = jax.eval_shape(env.reset_env, key, other)
        own = tuple(getattr(other, name) for name in entries)

        def many(tree: Tree) -> Codec[Tree]:
            batched = jax.tree.map(
                lambda leaf: jax.ShapeDtypeStruct((num_envs, *leaf.shape), leaf.dtype), tree
            )
            return Codec.of(batched, (num_envs,))

        self._program = _Program(self.env, Shared(params), entries, many(own), many((data, state)))
        action = jax.ShapeDtypeStruct((len(env.action_names),), obs.dtype)
        step = jax.eval_shape(partial(bare_step, self.env), key, state, action, other)
        self.signature = signature_of((obs, *step[2:]))
        """Shapes and types of a step's results."""
        self.carry: Array | None = None
        self._own: Array | None = None
        self.members = np.zeros(num_envs, bool)

    def begin(
        self, chains: np.ndarray, mask: np.ndarray, params: Params
    ) -> tuple[Array, np.ndarray]:
        """Begin episodes with these parameters where the mask is true: the carry, and observations
        [n, obs] that mean nothing elsewhere."""
        own = tuple(getattr(params, name) for name in self._program.entries)
        own = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, (len(mask), *jnp.shape(leaf))), own)
        before = None if self.carry is None or mask.all() else (self.carry, self._own)
        carry, self._own, obs = _begin(self._program, chains, own, mask, before)
        self.carry = carry
        return carry, np.array(obs)

    def step(self, actions: np.ndarray) -> np.ndarray:
        """One control step: the rows of `row_of`."""
        self.carry, table = _go_on(self._program, self.carry, self._own, actions)
        return np.array(table)

    def unpacked(self) -> Any:
        """The key chains, as plain numbers, and the states."""
        return unpack(self._program.carry, self.carry)


def signature_of(tree: object) -> Signature:
    """Structure, shapes and types; hashable."""
    leaves, structure = jax.tree.flatten(tree)
    return structure, tuple((leaf.shape, str(leaf.dtype)) for leaf in leaves)


@partial(jax.jit, static_argnums=0)
def unpack(codec: Codec[Tree], packed: Array) -> Tree:
    """The tree that the codec packed."""
    return codec.unpack(packed)


@partial(jax.jit, static_argnums=0)
def _begin(
    program: _Program,
    chains: Integer[Array, "n words"],
    own: tuple[object, ...],
    mask: Bool[Array, " n"],
    before: tuple[Array, Array] | None,
) -> tuple[Array, Array, Float[Array, "n obs"]]:
    after, subkeys = split(chains)
    obs, states = jax.vmap(lambda key, own: program.env.reset_env(key, program.params(own)))(
        subkeys, own
    )
    packed = program.carry.pack((after, states)), program.own.pack(own)
    if before is not None:  # packed with the environments last
        packed = jax.tree.map(partial(jnp.where, mask), packed, before)
    return packed[0], packed[1], obs


@partial(jax.jit, static_argnums=0)
def _go_on(
    program: _Program,
    carry: Array,
    own: Array,
    actions: Float[Array, "n act"],
) -> tuple[Array, Array]:
    return jax.vmap(partial(_go_on_one, program), (-1, -1, 0), (-1, 0))(carry, own, actions)


@partial(fused, fixed=1)
def _go_on_one(
    program: _Program,
    carry: Integer[Array, " words"],
    own: Integer[Array, " own"],
    action: Float[Array, " act"],
) -> tuple[Array, Array]:
    """One environment's step; carry, own: its packed columns. The row of `row_of`, too."""
    codec = program.carry.of_one
    chain, state = codec.unpack(carry)
    params = program.params(program.own.of_one.unpack(own))
    obs, state, reward, terminated, truncated, info = bare_step(
        program.env, None, state, action, params
    )
    return codec.pack((chain, state)), row_of(obs, reward, terminated, truncated, info)
