"""Programs that run once, compiled in a hurry, and numbers of the host under the transfer guard.

What prepares a robot or a track is computed when the user makes one and never again. With XLA's
costly passes such a program takes seconds to compile and runs for a millisecond; without them it
compiles in a quarter of the time and runs for two. Its numbers then differ from what the same
function gives inside the user's own jit by roundings, as those of any two programs do.
"""

from __future__ import annotations

from functools import wraps
from typing import TYPE_CHECKING, ParamSpec, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import is_concrete

if TYPE_CHECKING:
    from collections.abc import Callable

Given = ParamSpec("Given")
Result = TypeVar("Result")
GUARDS = ("jax_transfer_guard_host_to_device", "jax_transfer_guard_device_to_host")
FREE = (None, "allow")
"""Settings with which the transfer guard does nothing."""


def moves_numbers(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """`function`, of Python's numbers and NumPy's arrays, also where jax_transfer_guard forbids
    that they are moved to the device and back.

    For what prepares a robot or a track once, and for what is NumPy's by its interface. What runs
    in a user's own loop of JAX stays under the guard. Without a guard nothing is set.
    """

    @wraps(function)
    def call(*given: Given.args, **named: Given.kwargs) -> Result:
        if all(getattr(jax.config, name) in FREE for name in GUARDS):
            return function(*given, **named)
        with jax.transfer_guard("allow"):
            return function(*given, **named)

    return call


NO_PLAIN_EMITTER = (0, 11)
"""First version of JAX whose XLA has one emitter: preparing a robot then takes 2.5 s, not 1 s."""
IN_A_HURRY: dict[str, bool | int] = {"xla_backend_optimization_level": 0}
"""Options of XLA's CPU compiler: LLVM as it comes, and each kernel by the plain emitter."""
if jax.__version_info__[:2] < NO_PLAIN_EMITTER:
    IN_A_HURRY["xla_cpu_use_fusion_emitters"] = False


def run_once(function: Callable[..., Result], fixed: int = 0) -> Callable[..., Result]:
    """`function` of pytrees of arrays, compiled in a hurry where nothing is traced.

    fixed: so many arguments come first that are hashable and no arrays. Positional arguments only.
    Inside jit, vmap and grad, and on other platforms, it is `jax.jit(function)`.
    """
    static = tuple(range(fixed))
    usual = jax.jit(function, static_argnums=static, inline=True)
    hurried = jax.jit(function, static_argnums=static, compiler_options=IN_A_HURRY)

    @wraps(function)
    @moves_numbers
    def call(*arguments: object) -> Result:
        if jax.default_backend() != "cpu" or _in_a_trace(arguments):
            return usual(*arguments)
        return hurried(*arguments)

    return call


def _in_a_trace(arguments: object) -> bool:
    """True if an argument is traced, or all that is computed here is."""
    return not is_concrete(arguments, jnp.asarray(np.float32(0)))
