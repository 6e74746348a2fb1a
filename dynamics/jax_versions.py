"""Parts of JAX beyond its public interface that kernels use, and fallbacks where they are missing.

JAX lets others add operations and read traced functions (`jax.extend.core`, `jax.interpreters`),
and changes how. Here is what differs between versions. On one newer than any that was tried, a
trial decides whether an operation is used: without kernels results are the same, and slower.
"""

from __future__ import annotations

import warnings
from functools import partial
from operator import eq
from typing import TYPE_CHECKING, TypeAlias, TypeGuard

import jax
import jax.numpy as jnp
from jax.extend import core

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from jax.extend.core import ClosedJaxpr, Jaxpr, JaxprEqn, Literal, Primitive, Var
    from jax.typing import ArrayLike
    from jaxtyping import Array

    Atom: TypeAlias = Var | Literal
    Function = Callable[..., list[Array]]

TRIED = (0, 12)
"""The newest minor version with which all tests of kernels ran."""

Refused: tuple[type[Exception], ...] = (ImportError, AttributeError, TypeError, KeyError)
"""Exceptions of a missing or changed interface."""

_unregistered: dict[Primitive, Exception] = {}
"""Operations without rules, and why."""


def unclosed(traced: ClosedJaxpr | Jaxpr) -> Jaxpr:
    """Operations, arguments and results of a traced function: from JAX 0.11 on it itself."""
    return traced if isinstance(traced, core.Jaxpr) else traced.jaxpr


def constants_of(traced: ClosedJaxpr | Jaxpr) -> Sequence[ArrayLike]:
    """Values of a traced function's constants; empty where they are arguments."""
    return getattr(traced, "consts", ())


def is_traced(param: object) -> TypeGuard[ClosedJaxpr]:
    """True if an operation's parameter is a traced function."""
    return hasattr(param, "eqns")


def changing(scan: JaxprEqn, body: Jaxpr) -> list[Var]:
    """Arguments of a scan's body that differ from step to step: what is carried and what is cut out
    of longer arrays. Told by their shapes: how an operation names them is no public matter.
    """

    def whole(outside: Sequence[Atom], inside: Sequence[Atom]) -> int:
        return sum(map(eq, map(_axes, outside), map(_axes, inside)))

    carried = whole(scan.outvars, body.outvars)
    constant = whole(scan.invars, body.invars) - carried
    return body.invars[constant:]


def _axes(atom: Atom) -> int:
    return len(getattr(atom.aval, "shape", ()))


def thinned(traced: ClosedJaxpr, needed: Sequence[bool]) -> tuple[ClosedJaxpr, list[bool]]:
    """A traced function without the results that nothing reads, and which arguments are left."""
    from jax.interpreters.partial_eval import dce_jaxpr

    rest, kept = dce_jaxpr(unclosed(traced), needed)
    return rest if _is_closed(rest) else core.ClosedJaxpr(rest, traced.consts), kept


def _is_closed(traced: object) -> TypeGuard[ClosedJaxpr]:
    return hasattr(traced, "consts")


def register(
    operation: Primitive,
    batched: Callable[..., tuple[object, object]],
    anywhere: Callable[..., object],
    on_cpu: Callable[..., object] | None = None,
    slope: Callable[..., tuple[object, object]] | None = None,
    back: Callable[..., Sequence[object]] | None = None,
) -> None:
    """Register an operation's batching rule and lowering, `on_cpu` where that differs.

    slope, back: its rules for forward derivatives and for their transposition, where it has any.
    Where JAX does not take them, `refusal` says so.
    """
    several = operation.multiple_results
    try:
        from jax.interpreters import ad, batching, mlir

        batching.primitive_batchers[operation] = batched
        mlir.register_lowering(operation, mlir.lower_fun(anywhere, multiple_results=several))
        if on_cpu is not None:
            lowered = mlir.lower_fun(on_cpu, multiple_results=several)
            mlir.register_lowering(operation, lowered, "cpu")
        if slope is not None:
            ad.primitive_jvps[operation] = slope
        if back is not None:
            ad.primitive_transposes[operation] = back
    except Refused as error:
        _unregistered[operation] = error


def register_thinning(
    operation: Primitive,
    needed: Callable[[list[bool], JaxprEqn], tuple[list[bool], JaxprEqn | None]],
) -> None:
    """Register an operation's dead-code elimination.

    JAX 0.12 says in between whether arguments that are references are read later: none are.
    Where the rule cannot be given, all results are computed.
    """
    try:
        from jax.interpreters.partial_eval import dce_rules

        dce_rules[operation] = lambda read, *others: needed(read, others[-1])
    except Refused:
        pass


def unregister_thinning(operation: Primitive) -> None:
    """Have all results of an operation computed."""
    try:
        from jax.interpreters.partial_eval import dce_rules

        dce_rules.pop(operation, None)
    except Refused:
        pass


def refusal(operation: Primitive, trial: Callable[[], bool]) -> Exception | None:
    """Reason why this JAX does not support an operation, or None.

    trial: whether a small program with it gives the right numbers; run where nobody has tried.
    """
    if operation in _unregistered:
        return _unregistered[operation]
    if jax.__version_info__[:2] <= TRIED:
        return None
    try:
        with jax.ensure_compile_time_eval():
            right = trial()
    except Exception as error:  # noqa: BLE001, an untried JAX may raise anything
        return error
    return None if right else ArithmeticError("other numbers")


def works(operation: Primitive, fuse: Callable[[Function], Function]) -> bool:
    """True if this JAX supports kernels.

    operation: the kernel's; fuse: what makes a function one. Warns where it does not do.
    """
    trial = partial(_same_numbers, fuse)
    refused = refusal(operation, trial)
    if refused is not None:
        unregister_thinning(operation)
        refused = refusal(operation, trial)
    return refused is None or _without(refused)


def _same_numbers(fuse: Callable[[Function], Function]) -> bool:
    """True if a small program gives the same numbers with a kernel and without."""
    found, wanted = _program(fuse(_small)), _program(_small)
    return bool(jax.tree.all(jax.tree.map(partial(jnp.allclose, atol=1e-5), found, wanted)))


def _small(x: Array, key: Array) -> list[Array]:
    """Loops, random numbers, and a result that is not read."""
    x = jax.lax.while_loop(lambda x: x > 1, lambda x: jnp.sqrt(x) - 0.1, x)
    x, rows = jax.lax.scan(lambda x, y: (jnp.sin(x) + y, x * y), x, jnp.arange(3.0, dtype=x.dtype))
    return [jax.nn.relu(x) + jax.random.uniform(key, dtype=x.dtype), jnp.sum(rows)]


def _program(function: Function) -> Array:
    """A trial program over a batch too large for one block."""

    def step(x: Array, key: Array) -> tuple[Array, None]:
        return jax.vmap(function)(x, jax.random.split(key, x.size))[0], None

    x, keys = jnp.linspace(0.5, 2.0, 65), jax.random.split(jax.random.key(0), 2)
    return jax.jit(partial(jax.lax.scan, step))(x, keys)[0]


def _without(refused: Exception) -> bool:
    warnings.warn(
        f"stickslip has not been tried with JAX {jax.__version__} and does without kernels: "
        "results are the same, batches several times slower "
        f"({type(refused).__name__}: {refused})",
        RuntimeWarning,
        stacklevel=2,
    )
    return False
