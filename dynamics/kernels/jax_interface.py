"""Parts of JAX beyond its public interface that kernels use.

JAX lets others add operations and read traced functions (`jax.extend.core`, `jax.interpreters`) and
changes how; pyproject.toml admits the versions with which all tests of kernels ran.
"""

from __future__ import annotations

from operator import eq
from typing import TYPE_CHECKING, TypeAlias, TypeGuard

from jax.extend import core
from jax.interpreters import ad, batching, mlir
from jax.interpreters.partial_eval import dce_jaxpr, dce_rules

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from jax.extend.core import ClosedJaxpr, Jaxpr, JaxprEqn, Literal, Primitive, Var
    from jax.typing import ArrayLike

    Atom: TypeAlias = Var | Literal


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


def without_unread(traced: ClosedJaxpr, needed: Sequence[bool]) -> tuple[ClosedJaxpr, list[bool]]:
    """A traced function without the results that nothing reads, and which arguments are left."""
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
    """
    several = operation.multiple_results
    batching.primitive_batchers[operation] = batched
    mlir.register_lowering(operation, mlir.lower_fun(anywhere, multiple_results=several))
    if on_cpu is not None:
        lowered = mlir.lower_fun(on_cpu, multiple_results=several)
        mlir.register_lowering(operation, lowered, "cpu")
    if slope is not None:
        ad.primitive_jvps[operation] = slope
    if back is not None:
        ad.primitive_transposes[operation] = back


def register_dead_code_rule(
    operation: Primitive,
    needed: Callable[[list[bool], JaxprEqn], tuple[list[bool], JaxprEqn | None]],
) -> None:
    """Register an operation's dead-code elimination.

    JAX 0.12 says in between whether arguments that are references are read later: none are.
    """
    dce_rules[operation] = lambda read, *others: needed(read, others[-1])
