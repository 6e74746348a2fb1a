"""Programs that run once: compiled in a hurry, since compiling them takes all of the time.

What prepares a robot or a track is computed when the user makes one and never again. With XLA's
costly passes such a program takes seconds to compile and runs for a millisecond; without them it
compiles in a quarter of the time and runs for two. Its numbers then differ from what the same
function gives inside the user's own jit by roundings, as those of any two programs do.
"""

from __future__ import annotations

import re
from functools import cache, wraps
from typing import TYPE_CHECKING, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import is_concrete
from stickslip.dynamics.transfers import moves_numbers

if TYPE_CHECKING:
    from collections.abc import Callable

IN_A_HURRY = {"xla_cpu_use_fusion_emitters": False, "xla_backend_optimization_level": 0}
"""Options of XLA's CPU compiler: each kernel by the plain emitter, and LLVM as it comes. JAX 0.11
has no plain emitter any more: preparing a robot then takes 2.5 s of compiling rather than 1, and 4
without the other option."""
UNKNOWN = re.compile(r"[Nn]o such compile option: '(\w+)'")
"""XLA's message about an unknown option."""

_unknown: set[str] = set()
"""Options that XLA was found not to know."""

Result = TypeVar("Result")


def run_once(function: Callable[..., Result], fixed: int = 0) -> Callable[..., Result]:
    """`function` of pytrees of arrays, compiled in a hurry where nothing is traced.

    fixed: so many arguments come first that are hashable and no arrays. Positional arguments only.
    Inside jit, vmap and grad, and on other platforms, it is `jax.jit(function)`; options that XLA
    does not know are left out.
    """
    static = tuple(range(fixed))
    usual = jax.jit(function, static_argnums=static, inline=True)

    @cache
    def hurried(options: tuple[tuple[str, bool | int], ...]) -> Callable[..., Result]:
        return jax.jit(function, static_argnums=static, compiler_options=dict(options))

    @wraps(function)
    @moves_numbers
    def call(*arguments: object) -> Result:
        if jax.default_backend() != "cpu" or _in_a_trace(arguments):
            return usual(*arguments)
        while options := known(IN_A_HURRY):
            try:
                return hurried(tuple(options.items()))(*arguments)
            except jax.errors.JaxRuntimeError as error:
                said = UNKNOWN.search(str(error))
                if said is None or said[1] not in options:
                    raise
                _unknown.add(said[1])
        return usual(*arguments)

    return call


def as_one_program(function: Callable[..., Result]) -> Callable[..., Result]:
    """`function` of pytrees of arrays, compiled as a whole where nothing is traced, rather than one
    operation after the other; part of what is being compiled in a trace. Positional arguments only.
    """
    whole = jax.jit(function)

    @wraps(function)
    @moves_numbers
    def call(*arguments: object) -> Result:
        return (whole if is_concrete(arguments) else function)(*arguments)

    return call


def known(options: dict[str, bool | int]) -> dict[str, bool | int]:
    """Without those that XLA was found not to know."""
    return {name: value for name, value in options.items() if name not in _unknown}


def _in_a_trace(arguments: object) -> bool:
    """True if an argument is traced, or all that is computed here is."""
    return not is_concrete(arguments, jnp.asarray(np.float32(0)))
