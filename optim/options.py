"""Checks of what methods and problems are given, in double precision, and of the process."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from functools import wraps
from typing import Any

import numpy as np

from stickslip.dynamics.checks import require_number
from stickslip.dynamics.numeric import require_one

FORKED = (
    "this process was forked from one in which JAX had run, whose threads a fork leaves behind; "
    'accepted: processes that are spawned (multiprocessing.get_context("spawn").Pool, '
    'AsyncVectorEnv(..., context="spawn"))'
)
COUNT = 10**12
"""The greatest number of iterations, edges and the like that may be asked for."""


def require_scalar(name: str, value: Any, **rule: Any) -> None:
    """`require_one` in double precision, whatever jax_enable_x64 says."""
    require_one(name, value, dtype=np.float64, **rule)


def as_floats(name: str, value: Any, accepted: str) -> np.ndarray:
    """Numbers in double precision, or ValueError for what is none, or not finite there."""
    usual = type(value) is np.ndarray and value.dtype == float and value.size > 0
    if usual and np.isfinite(value).all():  # what optimisers ask with, again and again
        return value
    require_number(name, value, accepted=accepted, dtype=np.float64)
    return np.asarray(value, dtype=float)


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


def float64_program(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function; calls enter double precision, whatever jax_enable_x64 says, and return
    NumPy arrays."""
    import jax

    program = jax.jit(function)

    @wraps(function)
    def run(*arguments: Any) -> Any:
        refuse_after_fork()
        with jax.enable_x64(True):
            return jax.tree.map(np.asarray, program(*arguments))

    return run
