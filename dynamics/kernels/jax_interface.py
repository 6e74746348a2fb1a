"""Parts of JAX beyond its public interface that kernels use.

JAX lets others add operations and read traced functions (`jax.extend.core`, `jax.interpreters`) and
changes how; pyproject.toml admits the versions with which all tests of kernels ran.

It traces a function of `jax.custom_jvp` twice: for its value, and by its rule. Under vmap it notes
which results of the value have the batch and along which axis, and inside jit takes the rule's for
the same without looking. A rule that computes the value another way may have the batch in another
place, or none: the program is then refused with a message about shapes or, where sizes happen to
agree, gives wrong derivatives. Hence `jvp_in_front`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import eq
from typing import TYPE_CHECKING, TypeAlias, TypeGuard, TypeVar

import jax
import jax.numpy as jnp
from jax.extend import core
from jax.extend.core import ClosedJaxpr, Jaxpr, JaxprEqn, Literal, Primitive, Var
from jax.interpreters import ad, batching, mlir
from jax.interpreters.partial_eval import dce_jaxpr, dce_rules

from stickslip.dynamics.pytrees import as_plain

if TYPE_CHECKING:
    from jax.core import ShapedArray
    from jax.typing import ArrayLike
    from jaxtyping import Array

    Atom: TypeAlias = Var | Literal

Tree = TypeVar("Tree")

KERNEL = "stickslip_kernel"
"""Name of the primitive that stands for a fused function (see kernels/fused.py)."""
IN_FRONT = "stickslip_in_front"
"""Name of the primitive that marks the batch axis."""


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
    unread: Callable[[list[bool], JaxprEqn], tuple[list[bool], JaxprEqn | None]] | None = None,
) -> None:
    """Register an operation's batching rule and lowering, `on_cpu` where that differs.

    slope, back, unread: its rules for forward derivatives, for their transposition and for
    dead-code elimination, where it has any. JAX 0.12 gives the last one in between whether
    arguments that are references are read later: none are.
    """
    several = operation.multiple_results
    batching.primitive_batchers[operation] = batched
    mlir.register_lowering(operation, mlir.lower_fun(anywhere, multiple_results=several))
    if on_cpu is not None:
        mlir.register_lowering(operation, mlir.lower_fun(on_cpu, multiple_results=several), "cpu")
    if slope is not None:
        ad.primitive_jvps[operation] = slope
    if back is not None:
        ad.primitive_transposes[operation] = back
    if unread is not None:
        dce_rules[operation] = lambda read, *others: unread(read, others[-1])


def jvp_in_front(
    function: Callable[..., Tree], primals: Sequence[object], tangents: Sequence[object]
) -> tuple[Tree, Tree]:
    """`jax.jvp`, for a rule of a function that has the batch first in all its results where any of
    its arguments has one, as calls of `custom_vmap`, kernels and loops do.
    """
    value, slope = jax.jvp(function, tuple(primals), tuple(tangents))
    leaves = [as_plain(leaf) for leaf in jax.tree.leaves(primals)]
    mark = jnp.concatenate([jnp.ravel(leaf)[:0].astype(bool) for leaf in leaves])  # no numbers
    return jax.tree.map(lambda leaf: _in_front(leaf, mark), value), jax.tree.map(_in_front, slope)


def _in_front(leaf: Array, *mark: Array) -> Array:
    if leaf.dtype == jax.dtypes.float0:
        return leaf
    return in_front_p.bind(leaf, *mark)


in_front_p = Primitive(IN_FRONT)
"""Its first operand, with the batch first where any operand has one."""


@in_front_p.def_impl
def _itself(leaf: Array, *mark: Array) -> Array:
    return leaf


@in_front_p.def_abstract_eval
def _shape(leaf: ShapedArray, *mark: ShapedArray) -> ShapedArray:
    return leaf


def _batched(operands: Sequence[Array], axes: Sequence[int | None]) -> tuple[Array, int]:
    size = next(one.shape[at] for one, at in zip(operands, axes, strict=True) if at is not None)
    leaf, axis = operands[0], axes[0]
    if axis is None:
        front = jnp.broadcast_to(leaf, (size, *leaf.shape))
    else:
        front = jnp.moveaxis(leaf, axis, 0)
    return in_front_p.bind(front, *operands[1:]), 0


def _slope(primals: Sequence[Array], tangents: Sequence[object]) -> tuple[Array, object]:
    slope = tangents[0]
    if type(slope) is not ad.Zero:
        slope = in_front_p.bind(slope)
    return in_front_p.bind(*primals), slope


register(in_front_p, _batched, _itself, slope=_slope, back=lambda cotangent, leaf: [cotangent])
