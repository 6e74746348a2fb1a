"""Frozen dataclasses as pytrees: registration, derived fields, a short repr; sums of trees.

JAX has `jax.tree_util.register_dataclass`. Its structures compare equal (JAX 0.10) where two
classes have as many fields and the same static ones: those of a bump and a step, say. A compiled
program is looked up by its arguments' structure, first by hash and then by that comparison, so that
once in some hundred processes, where two hashes happen to fall together, a step would be driven
over by the program of a bump, without a word. Nodes registered with functions of their own compare
their class.

A derived part is a field with init=False, which the constructor does not take: `__post_init__`
computes it, so that `dataclasses.replace` computes it anew from whatever was replaced, and refuses
a derived part by name. JAX rebuilds trees without the constructor: what it puts together was
together before.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import MISSING, fields, is_dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from stickslip.dynamics.checks import shown

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from jaxtyping import Array, Float

Tree = TypeVar("Tree")


def settle(tree: Any, **values: Any) -> None:
    """Set fields of an instance that is being made."""
    for name, value in values.items():
        object.__setattr__(tree, name, value)


def rebuilt(tree: Tree, **values: Any) -> Tree:
    """A copy with fields changed, derived ones among them, and nothing computed.

    For those who compute the derived parts themselves, inside the module that defines them.
    """
    copy = object.__new__(type(tree))
    settle(copy, **{**{one.name: getattr(tree, one.name) for one in fields(tree)}, **values})  # type: ignore[arg-type]
    return copy


def holds_numbers(*trees: Any) -> bool:
    """True if every leaf is a number, traced or not, and one is no Python int.

    False for trees of what else JAX functions take, such as axes to map over, which are whole
    numbers: nothing can be derived from those.
    """
    leaves = jax.tree.leaves(trees)
    numbers = jax.Array | np.ndarray | np.number | float
    return any(isinstance(leaf, numbers) for leaf in leaves) and all(
        isinstance(leaf, numbers | int) for leaf in leaves
    )


Class = TypeVar("Class", bound=type)


def register_pytree(cls: Class) -> Class:
    """Register a dataclass as a pytree, in place of `jax.tree_util.register_dataclass`.

    Fields with metadata {"static": True} are part of the structure and hashable, all others are
    children. TypeError for what is no dataclass.
    """
    given: object = cls
    if not (isinstance(given, type) and is_dataclass(given)):
        raise TypeError(f"register_pytree of {given!r}; accepted: a class made by @dataclass")
    names = [one.name for one in fields(given)]
    static = [one.name for one in fields(given) if one.metadata.get("static")]
    children = [name for name in names if name not in static]
    keys = [jax.tree_util.GetAttrKey(name) for name in children]

    def flatten(tree: object) -> tuple[list[object], tuple[object, ...]]:
        parts = [getattr(tree, name) for name in children]
        return parts, tuple([getattr(tree, name) for name in static])

    def flatten_with_keys(tree: object):
        parts, rest = flatten(tree)
        return list(zip(keys, parts, strict=True)), rest

    def unflatten(rest: tuple[object, ...], parts: Iterable[object]):
        tree = object.__new__(cls)
        settle(tree, **dict(zip(static, rest, strict=True)))
        settle(tree, **dict(zip(children, parts, strict=True)))
        return tree

    jax.tree_util.register_pytree_with_keys(cls, flatten_with_keys, unflatten, flatten)
    return cls


FEW = 6
"""Most numbers, or entries, that are shown one by one."""
LONGEST = 24
"""Characters of what is no number."""


def short_repr(self: Any) -> str:
    """`__repr__` of a dataclass: its `in_short()`, or the entries that differ from their defaults.

    Never raises: for batches, traced and deleted numbers and axes to map over, too.
    """
    name = type(self).__name__
    try:
        return self.in_short() if hasattr(self, "in_short") else f"{name}({joined(self)})"
    except Exception:  # noqa: BLE001, a repr is read in a debugger, of whatever is half made
        return f"{name}(...)"


def joined(tree: Any, *first: str, usual: Mapping[str, Any] | None = None) -> str:
    """The text `first` with the entries that differ from the defaults, or a few of them."""
    words = list(differing(tree, usual))
    if len(words) > FEW:
        words = [*words[: FEW // 2], f"{len(words) - FEW // 2} more"]
    return ", ".join([*first, *words])


def differing(tree: Any, usual: Mapping[str, Any] | None = None) -> Iterator[str]:
    """ "name=value" of the entries that differ from `usual`, or from the fields' defaults."""
    if usual is None:
        usual = {one.name: one.default for one in fields(tree) if one.repr}
    for name, default in usual.items():
        value = getattr(tree, name)
        if default is MISSING or not _same(value, default):
            yield f"{name}={brief(value)}"


def brief(value: Any) -> str:
    """A number to four digits, a few of them in brackets, of many their type, shape and range."""
    if isinstance(value, Tracer):
        return f"traced{list(value.shape) or ''}"
    if isinstance(value, tuple | list) and len(value) <= FEW:
        return f"({', '.join(map(brief, value))})"
    if isinstance(value, bool | str | None) or not _is_number(value):
        own = is_dataclass(value) and type(value).__repr__ is short_repr
        text = repr(value) if own else shown(value)
        return text if own or len(text) <= LONGEST else f"{text[:LONGEST]}..."
    array = np.asarray(value)
    if array.ndim == 0:
        return f"{array.item():.4g}"
    if array.ndim == 1 and array.size <= FEW:
        return f"[{', '.join(f'{one:.4g}' for one in array.tolist())}]"
    ends = f" from {array.min():.4g} to {array.max():.4g}" if array.size else ""
    return f"{array.dtype}{list(array.shape)}{ends}"


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number | np.ndarray | jax.Array) and not (
        isinstance(value, np.ndarray) and value.dtype.kind not in "fiu"
    )


def _same(value: Any, default: Any) -> bool:
    """True if a value is known to be the default, or a batch of it, to single precision."""
    if not (_is_number(value) or isinstance(value, tuple)) or default is None:
        return value is default or (isinstance(value, str) and value == default)
    leaves = jax.tree.leaves(value)
    if any(isinstance(leaf, Tracer) for leaf in leaves):
        return False
    value, default = np.asarray(value), np.asarray(default)
    alike = value.shape[value.ndim - default.ndim :] == default.shape
    return alike and np.allclose(value, default, rtol=1e-6, atol=0)


def float_type(*trees: Any):
    """The widest floating type among the leaves; plain numbers take the arrays' type."""
    leaves = jax.tree.leaves(trees)
    floating = [leaf for leaf in leaves if jnp.issubdtype(jnp.result_type(leaf), jnp.floating)]
    return jnp.result_type(*floating)


def all_finite(*trees: Any) -> jax.Array:
    """True if every number is finite."""
    leaves = [jnp.asarray(leaf) for leaf in jax.tree.leaves(trees)]
    finite = jnp.ones((), bool)
    for leaf in leaves:
        if jnp.issubdtype(leaf.dtype, jnp.floating):
            finite &= jnp.all(jnp.isfinite(leaf))
    return finite


def clock(time: Float[Array, ""], step: Float[Array, ""]) -> Float[Array, ""]:
    """time + step without the roundings of earlier steps: (n + 1) step where time is n step.

    n is found from the time itself: within a rounding, and up to 2^21 in single precision. Any
    other time is added to. Derivatives are those of the sum.
    """
    plain, epsilon = time + step, jnp.finfo(time.dtype).eps
    count = jnp.round(time / step)
    counts = (jnp.abs(count * step - time) <= epsilon * jnp.abs(time)) & (count < 0.25 / epsilon)
    return plain + jax.lax.stop_gradient(jnp.where(counts, (count + 1) * step - plain, 0.0))


def compensated(sums: Tree, rests: Tree, terms: Tree) -> tuple[Tree, Tree]:
    """sums + terms, and their rounding errors so far; trees of floating arrays.

    Begin with rests of 0. A sum of any length is good to a few roundings of its own: Knuth's exact
    error of an addition, fed back as Kahan does. A sum that overflows stays infinite.
    """
    totals, tree = jax.tree.flatten(sums)
    columns = zip(totals, *map(jax.tree.leaves, (rests, terms)), strict=True)
    after, left = zip(*(_added(*column) for column in columns), strict=True)
    return jax.tree.unflatten(tree, after), jax.tree.unflatten(tree, left)


def _added(total: Array, rest: Array, term: Array) -> tuple[Array, Array]:
    term = term + rest
    after = total + term
    added = after - total
    rest = (total - (after - added)) + (term - added)
    return after, jnp.where(jnp.isfinite(after), rest, 0.0)
