"""Programs that run once: compiled in a hurry, since compiling them takes all of the time.

What prepares a robot or a track is computed when the user makes one and never again. With XLA's
costly passes such a program takes seconds to compile and runs for a millisecond; without them it
compiles in a quarter of the time and runs for two. Its numbers then differ from what the same
function gives inside the user's own jit by roundings, as those of any two programs do.
"""

from __future__ import annotations

from functools import wraps
from typing import TYPE_CHECKING, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import is_concrete

if TYPE_CHECKING:
    from collections.abc import Callable

IN_A_HURRY = {"xla_cpu_use_fusion_emitters": False, "xla_backend_optimization_level": 0}
"""Options of XLA's CPU compiler: each kernel by the plain emitter, and LLVM as it comes."""

Result = TypeVar("Result")


def run_once(function: Callable[..., Result], fixed: int = 0) -> Callable[..., Result]:
    """`function` of pytrees of arrays, compiled in a hurry where nothing is traced.

    fixed: so many arguments come first that are hashable and no arrays. Positional arguments only.
    Inside jit, vmap and grad, on other platforms, and where XLA does not know the options, it is
    `jax.jit(function)`.
    """
    static = tuple(range(fixed))
    usual = jax.jit(function, static_argnums=static, inline=True)
    hurried = jax.jit(function, static_argnums=static, compiler_options=IN_A_HURRY)

    @wraps(function)
    def call(*arguments: object) -> Result:
        if jax.default_backend() != "cpu" or _in_a_trace(arguments):
            return usual(*arguments)
        try:
            return hurried(*arguments)
        except jax.errors.JaxRuntimeError as error:
            if "compile option" not in str(error):
                raise
            return usual(*arguments)

    return call


def as_one_program(function: Callable[..., Result]) -> Callable[..., Result]:
    """`function` of pytrees of arrays, compiled as a whole where nothing is traced, rather than one
    operation after the other; part of what is being compiled in a trace. Positional arguments only.
    """
    whole = jax.jit(function)

    @wraps(function)
    def call(*arguments: object) -> Result:
        return (whole if is_concrete(arguments) else function)(*arguments)

    return call


def _in_a_trace(arguments: object) -> bool:
    """Whether an argument is traced, or all that is computed here is."""
    return not is_concrete(arguments, jnp.asarray(np.float32(0)))
