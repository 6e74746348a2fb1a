"""Numbers and trees of numbers: types, frozen dataclasses as pytrees, sums, programs, copies.

`jax.tree_util.register_dataclass` makes structures that compare equal (JAX 0.10) where two classes
have as many fields and the same static ones, such as those of a bump and a step. JAX finds a
compiled program by the hash of its arguments' structure and then by that comparison. Where two
hashes collide, in one of some hundred processes, the program of a bump would drive over a step.
Nodes registered with functions of their own compare their class.

A derived part is a field with init=False that `__post_init__` computes: `dataclasses.replace`
computes it anew, and refuses it by name. JAX rebuilds trees without the constructor.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cache, cached_property, partial, wraps
from typing import TYPE_CHECKING, Any, TypeGuard, TypeVar, cast, dataclass_transform

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import is_concrete, require_number, require_precision, shown

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    Scalar = Float[Array, ""]
    """One number."""
    Integer = Int[Array, ""]
    Flag = Bool[Array, ""]

Result = TypeVar("Result")
Number = jax.Array | np.ndarray | np.number[Any] | int | float
"""Accepted types of a number or an array of numbers."""
Lists = Sequence[Number] | Sequence[Sequence[Number]]
"""Lists that functions make into arrays."""
Numbers = Number | Lists
Numeric = Any
"""The type of a numeric field: given as a Number and read as an array, which no narrower type says.
"""

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
        return parts, tuple(getattr(tree, name) for name in static)

    def flatten_with_keys(tree: object):
        parts, rest = flatten(tree)
        return list(zip(keys, parts, strict=True)), rest

    def unflatten(rest: tuple[Any, ...], parts: Iterable[object]):
        tree = object.__new__(cls)
        settle(tree, **dict(zip([*static, *children], [*rest, *parts], strict=True)))
        return tree

    jax.tree_util.register_pytree_with_keys(cls, flatten_with_keys, unflatten, flatten)
    return cls


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def pytree_dataclass(cls: Class) -> Class:
    """Decorate a class as a frozen dataclass that is a pytree, see `register_pytree`. It keeps
    copies of the arrays that it is made of; instances of the same numbers are equal."""
    derive = getattr(cls, "__post_init__", lambda tree: None)

    def settled(tree: Any, *given: Any) -> None:
        arrays = {k: v for k, v in vars(tree).items() if isinstance(v, np.ndarray | tuple | list)}
        settle(tree, **kept(arrays))
        derive(tree, *given)

    def equal(one: object, other: object) -> bool:
        (leaves, kind), (others, other_kind) = map(jax.tree.flatten, (one, other))
        pairs = zip(leaves, others, strict=False)
        same = (a is b or (np.shape(a) == np.shape(b) and np.all(a == b)) for a, b in pairs)
        return kind == other_kind and all(same)

    cls.__post_init__, cls.__eq__ = settled, equal  # pyright: ignore[reportAttributeAccessIssue]
    return register_pytree(dataclass(frozen=True)(cls))


def float_type(*trees: Any):
    """The widest floating type among the leaves; plain numbers take the arrays' type."""
    leaves = jax.tree.leaves(trees)
    floating = [leaf for leaf in leaves if jnp.issubdtype(jnp.result_type(leaf), jnp.floating)]
    return jnp.result_type(*floating)


def all_finite(*trees: Any) -> jax.Array:
    """True if every number is finite."""
    finite = jnp.ones((), bool)
    for leaf in map(jnp.asarray, jax.tree.leaves(trees)):
        if jnp.issubdtype(leaf.dtype, jnp.floating):
            finite &= jnp.all(jnp.isfinite(leaf))
    return finite


def clock(time: Scalar, step: Scalar) -> Scalar:
    """time + step without the roundings of earlier steps: (n + 1) step where time is n step.

    n is found from the time itself: within a rounding, and up to 2^21 in single precision. Any
    other time is added to. Derivatives are those of the sum.
    """
    plain, epsilon = time + step, jnp.finfo(time.dtype).eps
    count = jnp.round(time / step)
    counts = (jnp.abs(count * step - time) <= epsilon * jnp.abs(time)) & (count < 0.25 / epsilon)
    return plain + jax.lax.stop_gradient(jnp.where(counts, (count + 1) * step - plain, 0.0))


def is_key(leaf: object) -> TypeGuard[Array]:
    """True of random keys."""
    return isinstance(leaf, jax.Array) and jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key)


def as_plain(leaf: Any) -> Array:
    """A number, or an array of numbers or of random keys, as an array of numbers."""
    return jax.random.key_data(leaf) if is_key(leaf) else jnp.asarray(leaf)


def compensated(sums: Tree, rests: Tree, terms: Tree) -> tuple[Tree, Tree]:
    """sums + terms, and their rounding errors so far; trees of floating arrays.

    Begin with rests of 0. A sum of any length is good to a few roundings of its own: Knuth's exact
    error of an addition, fed back as Kahan does. A sum that overflows stays infinite.
    """

    def left(total: Array, term: Array, after: Array) -> Array:
        added = after - total
        rest = (total - (after - added)) + (term - added)
        return jnp.where(jnp.isfinite(after), rest, 0.0)

    terms = jax.tree.map(jnp.add, terms, rests)
    after = jax.tree.map(jnp.add, sums, terms)
    return after, jax.tree.map(left, sums, terms, after)


NO_PLAIN_EMITTER = (0, 11)
"""First version of JAX whose XLA has one emitter: preparing a robot then takes 2.5 s, not 1 s."""
IN_A_HURRY: dict[str, bool | int] = {"xla_backend_optimization_level": 0}
"""Options of XLA's CPU compiler: LLVM as it comes, and each kernel by the plain emitter."""
if jax.__version_info__[:2] < NO_PLAIN_EMITTER:
    IN_A_HURRY["xla_cpu_use_fusion_emitters"] = False


def run_once(function: Callable[..., Result], fixed: int = 0) -> Callable[..., Result]:
    """`function` of pytrees of arrays, compiled in a hurry where nothing is traced: without XLA's
    costly passes, in a quarter of the time. Numbers differ by roundings from those inside jit.

    fixed: so many arguments come first that are hashable and no arrays.
    Inside jit, vmap and grad, and on other platforms, it is `jax.jit(function)`.
    """
    static = tuple(range(fixed))
    usual = jax.jit(function, static_argnums=static, inline=True)
    hurried = jax.jit(function, static_argnums=static, compiler_options=IN_A_HURRY)

    @wraps(function)
    def call(*arguments: object, **named: object) -> Result:
        made_here = jax.device_put(np.float32(0))  # traced where all that is computed here is
        if jax.default_backend() != "cpu" or not is_concrete(arguments, named, made_here):
            return usual(*arguments, **named)
        # Inside an abstract trace JAX 0.10 would round NumPy's arrays to the precision of that
        # trace, not of the program. Of `asarray`, it compiles a program a shape.
        given, named = jax.tree.map(
            lambda leaf: jax.device_put(leaf) if isinstance(leaf, np.ndarray) else leaf,
            (arguments[fixed:], named),
        )
        return hurried(*arguments[:fixed], *given, **named)

    return call


def float_kind(dtype: Any, otherwise: Any):
    """The floating type of a name or a type, `otherwise` for None; ValueError for any other, and
    for float64 where JAX has it switched off and would compute in float32."""
    if dtype is None:
        return jnp.dtype(otherwise)
    try:
        kind = jnp.dtype(dtype)
    except Exception:  # noqa: BLE001, whatever a name or an object raises
        kind = None
    if kind is None or kind not in (jnp.float32, jnp.float64):
        raise ValueError(f"dtype = {shown(dtype)}; accepted: None, float32 or float64")
    require_precision("dtype", kind)
    return kind


def require_numeric(**values: Any) -> None:
    """Raise ValueError for what is neither a number nor an array of real numbers, whatever its
    value: text, bytes, booleans, None, lists. Cheap, for calls that are made often."""
    for name, value in values.items():
        why, dtype = "", getattr(value, "dtype", None)
        if isinstance(value, float | int) and not isinstance(value, bool):
            if isinstance(value, int) and abs(value) > sys.float_info.max:
                why = "is too large"
        elif getattr(dtype, "kind", None) not in ("f", "i", "u") and dtype != jnp.bfloat16:
            why = "is not a number"
        if why:
            raise ValueError(f"{name} = {shown(value)} {why}; accepted: a real number or an array")


def same_rank(*values: Number) -> tuple[jax.Array, ...]:
    """The arrays with axes of length 1 in front, so that all have as many; numbers as they are.

    Shapes are broadcast explicitly, so that code runs with jax_numpy_rank_promotion "raise".
    """
    rank = max(map(jnp.ndim, values))
    found = tuple(
        value
        if jnp.ndim(value) in (0, rank)
        else jnp.expand_dims(value, tuple(range(rank - jnp.ndim(value))))
        for value in values
    )
    return cast("tuple[jax.Array, ...]", found)


def where_positive(constant: Array, slope: Array) -> tuple[Array, Array]:
    """From and to which t, constant + slope t >= 0, of any shape; none is (inf, -inf)."""
    bound = -constant / jnp.where(slope == 0, 1.0, slope)
    never = (slope == 0) & (constant < 0)
    low = jnp.where(never, jnp.inf, jnp.where(slope > 0, bound, -jnp.inf))
    return low, jnp.where(never, -jnp.inf, jnp.where(slope < 0, bound, jnp.inf))


def as_float(value: Any) -> Any:
    """An integer of Python's as a float: traced, one above 2^31 has no type; others as they are."""
    return float(value) if isinstance(value, int) else value


def with_all_digits(values: np.ndarray) -> jax.Array:
    """The numbers as an array of JAX's, or as they are where its switch would round them now."""
    array = jax.device_put(values)
    return array if array.dtype == values.dtype else cast("jax.Array", values)


def require_one(name: str, value: Any, *, accepted: str, **rule: Any) -> float:
    """One number as a Python float, or ValueError; `rule` as in `require_number`."""
    if not is_concrete(value):
        raise ValueError(f"{name} is traced; accepted: {accepted}, known before tracing")
    require_number(name, value, accepted=accepted, **rule)
    if np.ndim(value):
        raise ValueError(f"{name} has shape {np.shape(value)}; accepted: {accepted}, one number")
    return float(value)


def require_broadcast(**values: Any) -> tuple[int, ...]:
    """The shape that the values broadcast to, or ValueError naming them."""
    shapes = {name: np.shape(value) for name, value in values.items()}
    try:
        return np.broadcast_shapes(*shapes.values())
    except ValueError:
        given = ", ".join(f"{name} {shape}" for name, shape in shapes.items() if shape)
        raise ValueError(f"shapes do not broadcast: {given}; accepted: the same, or ()") from None


def read_only(array: np.ndarray) -> np.ndarray:
    """A read-only copy."""
    kept = np.array(array, subok=True)
    kept.setflags(write=False)
    return kept


def kept(tree: Tree) -> Tree:
    """The tree with read-only copies of NumPy's arrays, which their owner may change later."""
    return jax.tree.map(lambda one: read_only(one) if isinstance(one, np.ndarray) else one, tree)


def given_state(one: object) -> dict[str, Any]:
    """State of copies and pickles: the object's attributes without cached properties, JAX's
    arrays as NumPy's. JAX restores its own in single precision outside `enable_x64`."""

    def in_numpy(leaf: Any) -> Any:
        return np.asarray(leaf) if isinstance(leaf, jax.Array) and not is_key(leaf) else leaf

    return {
        name: jax.tree.map(in_numpy, value)
        for name, value in vars(one).items()
        if not isinstance(getattr(type(one), name, None), cached_property)
    }


_MADE_IN = os.getpid()
_jax_ran = False
FORKED = (
    "this process was forked from one in which JAX had run, whose threads a fork leaves behind; "
    'accepted: processes that are spawned (multiprocessing.get_context("spawn").Pool, '
    'AsyncVectorEnv(..., context="spawn"))'
)


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
    """Compile a function that computes in double precision always, and returns NumPy arrays."""
    program = jax.jit(function)
    return wraps(function)(lambda *given: jax.tree.map(np.asarray, in_float64(program, *given)))


def bound_program(function: Callable[..., Any], *trees: Any) -> Callable[..., Any]:
    """The same with its first arguments given, returning JAX's arrays.

    Their numbers are put on the device once and go in as a flat tuple: a call with trees of
    dataclasses takes several times as long. Trees of one structure share a compiled program.
    """
    with jax.enable_x64(True):
        leaves, structure = jax.tree.flatten(jax.device_put(trees))
    return partial(in_float64, _program_of(function, structure), tuple(leaves))


def in_float64(program: Callable[..., Any], *arguments: Any) -> Any:
    """program(*arguments) in double precision; RuntimeError in a fork."""
    refuse_after_fork()
    with jax.enable_x64(True):
        return program(*arguments)


@cache
def _program_of(function: Callable[..., Any], structure: Any) -> Callable[..., Any]:
    return jax.jit(lambda leaves, *others: function(*structure.unflatten(leaves), *others))
