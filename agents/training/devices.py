"""Environments laid over several devices, of this process or of several; parameters on each.

A mesh has one axis, along which environments and samples are divided. Where one device learns there
is no mesh (None), and everything here leaves what it is given as it is.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from stickslip.dynamics.checks import require_integer

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Array

AXIS = "environments"
COPIED = PartitionSpec()
SPREAD, SPREAD_STEPS = PartitionSpec(AXIS), PartitionSpec(None, AXIS)
"""Of arrays [n, ...] and [steps, n, ...]."""
HOW_MORE = "on a processor XLA_FLAGS=--xla_force_host_platform_device_count=N makes N devices of it"

Tree = TypeVar("Tree")


def mesh_for(devices: int | None, *divided: int) -> Mesh | None:
    """The mesh of so many devices of each process; None for one device in one process.

    devices: default: as many as divide evenly what is to be divided, of those that there are.
    divided: numbers of environments, of samples. ValueError for more devices than there are, and
    for what they do not divide.
    """
    here, processes = jax.local_device_count(), jax.process_count()
    if devices is None:
        common = math.gcd(*divided)
        even = (one for one in range(here, 0, -1) if common % (one * processes) == 0)
        devices = next(even, here)
    most = f"1 to {here}, the devices of this process ({HOW_MORE})"
    devices = require_integer("devices", devices, high=here, accepted=most)
    if bad := [one for one in divided if one % (devices * processes)]:
        raise ValueError(
            f"devices = {devices} in {processes} process(es) do not divide {bad[0]}; accepted: "
            f"devices that divide num_envs and batch_size = {', '.join(map(str, divided))} evenly"
        )
    if devices * processes == 1:
        return None
    by_process = itertools.groupby(
        sorted(jax.devices(), key=lambda one: (one.process_index, one.id)),
        key=lambda one: one.process_index,
    )
    chosen = [one for _, own in by_process for one in list(own)[:devices]]
    return Mesh(np.asarray(chosen), (AXIS,))


def laid(mesh: Mesh | None, tree: Tree, how: PartitionSpec) -> Tree:
    """Inside a trace: the arrays divided or copied, whatever they were."""
    if mesh is None:
        return tree
    return jax.lax.with_sharding_constraint(tree, NamedSharding(mesh, how))


def put(mesh: Mesh | None, tree: Tree, how: PartitionSpec) -> Tree:
    """Outside of a trace: the arrays, whole in each process, divided or copied over the mesh."""
    if mesh is None:
        return tree
    sharding = NamedSharding(mesh, how)

    def one(leaf: Array) -> Array:
        whole = np.asarray(_plain(leaf))
        found = jax.make_array_from_callback(whole.shape, sharding, lambda at: whole[at])
        return jax.random.wrap_key_data(found) if is_key(leaf) else found

    return jax.tree.map(one, tree)


def fetched(tree: Tree) -> Tree:
    """The arrays as NumPy's, whole; random keys as plain numbers. Of divided ones every process
    needs to ask."""

    def one(leaf: Array) -> np.ndarray:
        leaf = _plain(leaf)
        if not isinstance(leaf, jax.Array) or leaf.is_fully_addressable or leaf.is_fully_replicated:
            return np.asarray(leaf)
        from jax.experimental.multihost_utils import process_allgather

        return np.asarray(process_allgather(leaf, tiled=True))

    return jax.tree.map(one, tree)


def asked_of_all(stop: Callable[[], bool]) -> Callable[[], bool]:
    """Whether any process is to stop, so that all do after the same update."""
    if jax.process_count() == 1:
        return stop
    from jax.experimental.multihost_utils import process_allgather

    return lambda: bool(np.any(process_allgather(np.asarray(stop()))))


def is_key(leaf: object) -> bool:
    """Whether these are random keys, as JAX types them."""
    return isinstance(leaf, jax.Array) and jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key)


def _plain(leaf: Array) -> Array:
    return jax.random.key_data(leaf) if is_key(leaf) else leaf
