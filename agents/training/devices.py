"""Environments laid over several devices of this process; parameters on each.

A mesh has one axis, along which environments and samples are divided. Where one device learns there
is no mesh (None), and everything here leaves what it is given as it is.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from stickslip.dynamics.checks import require_integer

if TYPE_CHECKING:
    from jaxtyping import Array

AXIS = "environments"
COPIED = PartitionSpec()
SPREAD, SPREAD_STEPS = PartitionSpec(AXIS), PartitionSpec(None, AXIS)
"""Of arrays [n, ...] and [steps, n, ...]."""
HOW_MORE = "on a processor XLA_FLAGS=--xla_force_host_platform_device_count=N makes N devices of it"

Tree = TypeVar("Tree")


def mesh_for(devices: int | None, *divided: int) -> Mesh | None:
    """The mesh of so many devices of this process; None for one.

    devices: default: as many as divide evenly what is to be divided, of those that there are.
    divided: numbers of environments, of samples. ValueError for more devices than there are, and
    for what they do not divide.
    """
    here = jax.local_device_count()
    if devices is None:
        common = math.gcd(*divided)
        devices = next(one for one in range(here, 0, -1) if common % one == 0)
    most = f"1 to {here}, the devices of this process ({HOW_MORE})"
    devices = require_integer("devices", devices, high=here, accepted=most)
    if bad := [one for one in divided if one % devices]:
        raise ValueError(
            f"devices = {devices} do not divide {bad[0]}; accepted: devices that divide num_envs "
            f"and batch_size = {', '.join(map(str, divided))} evenly"
        )
    return None if devices == 1 else Mesh(np.asarray(jax.local_devices()[:devices]), (AXIS,))


def laid(mesh: Mesh | None, tree: Tree, how: PartitionSpec) -> Tree:
    """Inside a trace: the arrays divided or copied, whatever they were."""
    if mesh is None:
        return tree
    return jax.lax.with_sharding_constraint(tree, NamedSharding(mesh, how))


def put(mesh: Mesh | None, tree: Tree, how: PartitionSpec) -> Tree:
    """Outside of a trace: the arrays divided or copied over the mesh."""
    return tree if mesh is None else jax.device_put(tree, NamedSharding(mesh, how))


def fetched(tree: Tree) -> Tree:
    """The arrays as NumPy's, whole; random keys as plain numbers."""

    def one(leaf: Array) -> np.ndarray:
        return np.asarray(jax.random.key_data(leaf) if is_key(leaf) else leaf)

    return jax.tree.map(one, tree)


def is_key(leaf: object) -> bool:
    """Whether these are random keys, as JAX types them."""
    return isinstance(leaf, jax.Array) and jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key)
