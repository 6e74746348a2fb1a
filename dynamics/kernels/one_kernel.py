"""A call that XLA's CPU backend compiles as one kernel, and the limits of such a kernel."""

from __future__ import annotations

import os
from functools import partial
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
from jax.experimental.xla_metadata import set_xla_metadata
from jax.extend.core import jaxpr_as_fun

from stickslip.dynamics.kernels.grouping import KERNEL, LOOPS, grouped, opened
from stickslip.dynamics.kernels.jax_interface import changing, is_traced, unclosed

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from jax.extend.core import ClosedJaxpr, Jaxpr, JaxprEqn
    from jaxtyping import Array

LARGEST_ARRAY = 2**14
"""Numbers of an intermediate array: XLA goes through larger ones with several threads, which it
cannot do in a kernel. A function with one is left as XLA takes it."""
SUMMED_UP = ("reduce_sum", "reduce_max", "reduce_min", "reduce_prod", "cum")
LARGEST_SUM = 2**11
"""Sums and the like of more numbers go to a library."""
SWITCH = "STICKSLIP_KERNELS"
"""The environment variable that is set to "off" where XLA cannot compile a kernel."""
AS_ONE_KERNEL = {"xla_cpu_small_call": "true", "inlineable": "false"}
"""Attributes of a call that XLA's CPU backend reads. They are not documented there: a test looks
for the kernel in compiled programs; where they are not read, results are the same and slower."""

NEVER_IN_A_KERNEL = (
    *("scatter", "select_and_scatter", "sort", "top_k", "approx_top_k", "fft", "conv_general"),
    *("dot_general", "ragged_dot"),
    *("lu", "qr", "geqrf", "householder", "cholesky", "triangular_solve", "tridiagonal", "eig"),
    *("svd", "schur", "hessenberg", "custom_linear_solve", "ffi_call", "pure_callback"),
    *("io_callback", "debug_callback", "debug_print", "custom_call", "psum", "all_", "ppermute"),
)
"""Beginnings of the names of primitives for which XLA's CPU backend needs a kernel of their own."""


def _as_it_is(*leaves: Array) -> Sequence[Array]:
    return leaves


def as_one_kernel(function: Callable[..., list[Array]]) -> Callable[..., list[Array]]:
    """The function as a call that XLA is asked to compile as one kernel, if that can be."""

    def call(*leaves: Array) -> list[Array]:
        return run_as_one_kernel(jax.make_jaxpr(function)(*leaves), leaves)

    return call


def run_as_one_kernel(
    traced: ClosedJaxpr, leaves: Sequence[Array], read: Callable[..., Sequence[Array]] = _as_it_is
) -> list[Array]:
    """A traced function of read(*leaves), where these are no random keys."""
    if switched_off() or not _can_be_one(unclosed(traced)):
        return list(jaxpr_as_fun(traced)(*read(*leaves)))
    run = grouped(traced)
    inner = jax.jit(partial(_and_first, lambda *leaves: run(*read(*leaves))))
    out, first = inner(*jax.lax.optimization_barrier(tuple(leaves)))
    marked = [set_xla_metadata(leaf, **AS_ONE_KERNEL) for leaf in (*out, *first)]
    return list(jax.lax.optimization_barrier(marked)[: len(out)])


def _and_first(function: Callable[..., list[Array]], *leaves: Array):
    """Results of the function, and the first number of every argument.

    XLA's compiler gives up the process over a kernel with an argument that nothing in it reads. The
    caller keeps these numbers from being pruned by passing them through a barrier.
    """
    first: dict[jnp.dtype, list[Array]] = {}
    for leaf in leaves:
        first.setdefault(leaf.dtype, []).append(jnp.ravel(leaf)[:1])
    return function(*leaves), [jnp.concatenate(parts) for parts in first.values()]


def switched_off() -> bool:
    """True if the user wants no kernels: SWITCH is "off" when a function is traced."""
    return os.environ.get(SWITCH, "").lower() in ("off", "0", "no", "false")


def _can_be_one(jaxpr: Jaxpr) -> bool:
    """True if nothing in there calls a library or needs more than loops over small arrays."""
    return all(map(_can_be_in_one, jaxpr.eqns))


def _can_be_in_one(equation: JaxprEqn) -> bool:
    name = equation.primitive.name
    atoms = [*equation.outvars]
    most = LARGEST_ARRAY
    if name.startswith(SUMMED_UP):
        atoms, most = [*equation.invars], LARGEST_SUM
    large = name not in LOOPS and any(getattr(atom.aval, "size", 0) > most for atom in atoms)
    if large or name.startswith(NEVER_IN_A_KERNEL):
        return False
    if name == KERNEL:
        return _can_be_one(unclosed(opened(equation)))
    leaves = jax.tree.leaves(list(equation.params.values()), is_leaf=is_traced)
    jaxprs = [unclosed(leaf) for leaf in leaves if is_traced(leaf)]
    if name == "scan" and any(  # what is cut out of its arguments is an array of its own
        getattr(one.aval, "size", 0) > LARGEST_ARRAY for one in changing(equation, jaxprs[0])
    ):
        return False
    return all(map(_can_be_one, jaxprs))
