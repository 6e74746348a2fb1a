"""Problems and objectives in other processes: pickling, and refusal after a fork."""

from __future__ import annotations

import os
import sys
from functools import cached_property
from typing import Any

import jax
import numpy as np

FORKED = (
    "this process was forked from one in which JAX had run, whose threads a fork leaves behind; "
    'accepted: processes that are spawned, as multiprocessing.get_context("spawn").Pool has'
)
_MADE_IN = os.getpid()
_jax_ran = False


def _before_fork() -> None:
    global _jax_ran
    bridge = sys.modules.get("jax._src.xla_bridge")
    _jax_ran = bool(getattr(bridge, "_backends", True))


if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_before_fork)


def refuse_after_fork() -> None:
    """RuntimeError where JAX would wait for ever: in a fork of a process in which it has run."""
    if _jax_ran and os.getpid() != _MADE_IN:
        raise RuntimeError(FORKED)


def given_state(one: object) -> dict[str, Any]:
    """State of copies and pickles: the object's attributes without cached properties, JAX's
    arrays as NumPy's. JAX restores its own in single precision outside `enable_x64`."""
    kind = type(one)
    return {
        name: jax.tree.map(_in_numpy, value)
        for name, value in vars(one).items()
        if not isinstance(getattr(kind, name, None), cached_property)
    }


def _in_numpy(leaf: Any) -> Any:
    is_numbers = isinstance(leaf, jax.Array) and not jax.dtypes.issubdtype(
        leaf.dtype, jax.dtypes.prng_key
    )
    return np.asarray(leaf) if is_numbers else leaf
