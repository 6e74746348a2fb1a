"""A call that XLA's CPU backend compiles as one kernel, rewritten to compute nothing twice.

Inside a kernel, XLA fuses whatever feeds a result into the loop that computes it, and so repeats
for each of many results what they have in common: ten times the arithmetic, for a step of the
biped. It does not look through the border of a call that may not be inlined. So every intermediate
result that several others need, and costs more than a few operations, gets a call of its own, with
all that only it needs.

Two computations of one value may differ by a rounding: the compiler contracts a product and a sum
into one operation where that suits the loop around them. So what is compared for equality, as the
derivative of a maximum compares it with its arguments, is computed once, however cheap it is.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
from jax.experimental.xla_metadata import set_xla_metadata
from jax.extend.core import ClosedJaxpr, Jaxpr, JaxprEqn, Literal, Primitive, Var, jaxpr_as_fun

from stickslip.dynamics.kernels.jax_interface import (
    IN_FRONT,
    KERNEL,
    changing,
    constants_of,
    is_traced,
    unclosed,
)

if TYPE_CHECKING:
    from jax.typing import ArrayLike
    from jaxtyping import Array

MOST_WORK = 2**13
"""Most work of a group: operations times the numbers of each. XLA goes through a costlier loop
with several threads, which it cannot do in a kernel; it does so from 200,000 on, ten for each byte
that goes in or comes out included, where there are more operations than bytes."""
LARGE_TABLE = 2**15
"""Bytes of a table from which each lookup is a group of its own. XLA counts a table whole where
what is looked up is used at once, and goes through 2^19 bytes with several threads."""
APART = {"inlineable": "false"}
"""Attributes that keep XLA from inlining a call."""
REPEATED = 24
"""Most operations that are recomputed rather than kept."""
FREE = (
    *("broadcast_in_dim", "reshape", "squeeze", "expand_dims", "transpose", "rev", "slice", "iota"),
    *("convert_element_type", "copy", "copy_p", "neg", "not", "stop_gradient"),
    *("random_wrap", "random_unwrap"),
)
"""Primitives that cost nothing where their result is used: repeated at will."""
DISSOLVED = {
    "jit": "jaxpr",
    "pjit": "jaxpr",
    "closed_call": "call_jaxpr",
    "custom_jvp_call": "call_jaxpr",
    "custom_vjp_call": "call_jaxpr",
    "custom_vmap_call": "call",
}
"""Calls that only group others, and the parameter that holds what they call."""
JOINS = ("concatenate", "stack")
"""Primitives whose operands are computed before: in one loop with them, XLA decides for each number
anew which operand it belongs to."""
LOOPS = ("while", "scan", "cond")


class _Step(NamedTuple):
    """One operation; operands and results are numbers of values, other operands constants."""

    primitive: Primitive
    params: dict[str, Any]
    operands: list[Operand]
    results: list[int]
    work: int
    """Numbers computed."""
    is_equality: bool
    """True if it asks if two values that were rounded are the same."""
    reads_much: bool
    """True if it looks something up in a table of LARGE_TABLE bytes."""

    @property
    def is_loop(self) -> bool:
        return self.primitive.name in LOOPS

    @property
    def is_free(self) -> bool:
        return self.primitive.name in FREE

    def inputs(self) -> list[int]:
        """Operands that are values."""
        return [one.number for one in self.operands if isinstance(one, _Value)]

    def run(self, values: dict[int, Array], params: dict[str, Any]) -> None:
        """Add the results to the values."""
        given = [values[one.number] if isinstance(one, _Value) else one for one in self.operands]
        found = self.primitive.bind(*given, **params)
        found = found if self.primitive.multiple_results else [found]
        values.update(zip(self.results, found, strict=True))


class _Value(NamedTuple):
    """The number of a value, among constants."""

    number: int


Operand: TypeAlias = "ArrayLike | _Value"
Atom: TypeAlias = "Var | Literal"


class _Program(NamedTuple):
    steps: list[_Step]
    inputs: list[int]
    outputs: list[Operand]


def grouped(traced: ClosedJaxpr) -> Callable[..., list[Array]]:
    """The traced function's value, computed group by group; of the same arguments."""
    program = _pruned(_flattened(traced))
    return partial(_run, program, _kept(program))


def _flattened(traced: ClosedJaxpr) -> _Program:
    """One list of operations, without calls."""
    steps: list[_Step] = []
    count = iter(range(10**9))

    def walk(
        jaxpr: Jaxpr, constants: Sequence[Operand], arguments: Sequence[Operand]
    ) -> list[Operand]:
        known = dict(zip(jaxpr.constvars, constants, strict=True))
        known.update(zip(jaxpr.invars, arguments, strict=True))

        def read(atom: Atom) -> Operand:
            return atom.val if isinstance(atom, Literal) else known[atom]

        for equation in jaxpr.eqns:
            operands = [read(atom) for atom in equation.invars]
            called = equation.params.get(DISSOLVED.get(equation.primitive.name, ""))
            if equation.primitive.name == KERNEL:
                called = opened(equation)
            if equation.primitive.name == IN_FRONT:
                found: list[Operand] = operands[:1]
            elif called is None:
                results = [next(count) for _ in equation.outvars]
                summed = equation.primitive.name.startswith(("reduce", "arg", "cum"))
                atoms = equation.invars if summed else equation.outvars
                work = max(getattr(atom.aval, "size", 1) for atom in atoms)
                reads_much = any(_bytes(atom) >= LARGE_TABLE for atom in equation.invars)
                tests = _asks_for_equality(equation, operands), reads_much
                step = _Step(equation.primitive, equation.params, operands, results, work, *tests)
                steps.append(step)
                found = [_Value(number) for number in results]
            else:
                found = walk(unclosed(called), constants_of(called), operands)
            known.update(zip(equation.outvars, found, strict=True))
        return [read(atom) for atom in jaxpr.outvars]

    whole = unclosed(traced)
    inputs = [next(count) for _ in whole.invars]
    outputs = walk(whole, traced.consts, [_Value(number) for number in inputs])
    return _Program(steps, inputs, outputs)


def _asks_for_equality(equation: JaxprEqn, operands: Sequence[Operand]) -> bool:
    values = {one.number for one in operands if isinstance(one, _Value)}
    return (
        equation.primitive.name in ("eq", "ne")
        and len(values) == 2
        and jnp.issubdtype(_shape(equation.invars[0].aval).dtype, jnp.floating)
    )


def opened(kernel: JaxprEqn) -> ClosedJaxpr:
    """Equations of a fused function inside another one."""
    shapes = [_shape(atom.aval) for atom in kernel.invars]
    return jax.make_jaxpr(kernel.params["kernel"].at_once)(*shapes)


def _shape(aval: Any) -> jax.ShapeDtypeStruct:
    return jax.ShapeDtypeStruct(aval.shape, aval.dtype, weak_type=aval.weak_type)


def _pruned(program: _Program) -> _Program:
    """Without operations that nothing needs."""
    needed = {one.number for one in program.outputs if isinstance(one, _Value)}
    kept = []
    for step in reversed(program.steps):
        if not needed.isdisjoint(step.results):
            kept.append(step)
            needed.update(step.inputs())
    return program._replace(steps=kept[::-1])


def _kept(program: _Program) -> set[int]:
    """Places of the operations whose results are kept: those that would be repeated too often.

    Free operations count as part of whatever uses their result.
    """
    users: dict[int, set[int]] = {}
    for place, step in enumerate(program.steps):
        for number in step.inputs():
            users.setdefault(number, set()).add(place)
    final = {one.number for one in program.outputs if isinstance(one, _Value)}
    loop = -1  # stands for whatever needs a value as it is
    needing: dict[int, set[int]] = {}
    for step in reversed(program.steps):
        for number in step.results:
            found = {loop} if number in final else set()
            for place in users.get(number, ()):
                user = program.steps[place]
                if user.is_free:
                    found |= needing[user.results[0]]
                else:
                    found.add(loop if user.is_loop or user.primitive.name in JOINS else place)
            needing[number] = found
    kept = _compared(program)
    makers = {number: place for place, step in enumerate(program.steps) for number in step.results}
    behind: dict[int, tuple[int, int]] = {}  # operations and work of a value that is not kept
    for place, step in enumerate(program.steps):
        if step.is_loop:
            continue
        inputs = set(step.inputs())
        work = sum(behind.get(number, (0, 0))[1] for number in inputs) + step.work
        if work > MOST_WORK or (step.reads_much and not step.is_free):
            inputs = {number for number in inputs if number not in behind}
            kept.update(makers[number] for number in step.inputs() if number in behind)
        parts = [behind.get(number, (0, 0)) for number in inputs]
        size, work = (sum(column) for column in zip((0, 0), *parts, strict=True))
        if not step.is_free:
            size, work = size + 1, work + step.work
        wanted = set().union(*(needing[number] for number in step.results))
        dear = size * (len(wanted) - 1) > REPEATED
        cut = dear or loop in wanted or len(step.results) > 1 or step.reads_much
        if not step.is_free and cut:
            kept.add(place)
        if place in kept:
            size, work = 0, 0
        behind.update(dict.fromkeys(step.results, (size, work)))
    return kept


def _compared(program: _Program) -> set[int]:
    """Places of operations whose results are compared for equality, perhaps behind free ones."""
    makers = {number: place for place, step in enumerate(program.steps) for number in step.results}
    found: set[int] = set()
    for step in program.steps:
        left = step.inputs() if step.is_equality else []
        while left:
            place = makers.get(left.pop())
            if place is None:  # an argument
                continue
            maker = program.steps[place]
            if maker.is_free:
                left = [*left, *maker.inputs()]
            elif not maker.is_loop:
                found.add(place)
    return found


def _run(program: _Program, kept: set[int], *arguments: Array) -> list[Array]:
    values: dict[int, Array] = dict(zip(program.inputs, arguments, strict=True))
    makers = {number: step for step in program.steps for number in step.results}
    for place, step in enumerate(program.steps):
        if step.is_loop:
            for number in step.inputs():
                _compute([number], makers, values)
            step.run(values, {name: _inside(value) for name, value in step.params.items()})
        elif place in kept:
            _compute(step.results, makers, values)
    for one in program.outputs:
        if isinstance(one, _Value):
            _compute([one.number], makers, values)
    return [
        values[one.number] if isinstance(one, _Value) else jnp.asarray(one)
        for one in program.outputs
    ]


def _compute(numbers: list[int], makers: dict[int, _Step], values: dict[int, Array]) -> None:
    """Add these results to the values, by a call of all that is still to be computed for them."""
    inputs: dict[int, None] = {}
    found: dict[int, _Step] = {}
    wanted = [number for number in numbers if number not in values]
    left = list(wanted)
    while left:
        number = left.pop()
        if number in values:
            inputs[number] = None
        elif (step := makers[number]).results[0] not in found:
            found[step.results[0]] = step
            left += step.inputs()
    steps = [found[number] for number in sorted(found)]  # results are numbered as they come

    def group(*given: Array) -> list[Array]:
        here = dict(zip(inputs, given, strict=True))
        for step in steps:
            step.run(here, step.params)
        return [here[number] for number in wanted]

    given = [values[number] for number in inputs]
    if all(step.is_free for step in steps):
        results = group(*given)
    else:
        results = [_marked(leaf) for leaf in jax.jit(group)(*given)]
    values.update(zip(wanted, results, strict=True))


def _marked(leaf: Array) -> Any:
    is_key = jnp.issubdtype(leaf.dtype, jax.dtypes.extended)
    return leaf if is_key else set_xla_metadata(leaf, **APART)


def _inside(param: object) -> object:
    """A loop's parameter, with what it runs grouped, too."""
    if is_traced(param):
        return jax.make_jaxpr(grouped(param))(*map(_shape, param.in_avals))
    if isinstance(param, tuple) and any(map(is_traced, param)):
        return tuple(map(_inside, param))
    return param


LARGEST_ARRAY = 2**14
"""Numbers of an intermediate array: XLA goes through larger ones with several threads, which it
cannot do in a kernel. A function with one is left as XLA takes it."""
SUMMED_UP = ("reduce_sum", "reduce_max", "reduce_min", "reduce_prod", "cum")
LARGEST_SUM = 2**11
"""Sums and the like of more numbers go to a library."""
LARGEST_CARRIED = 2**18
"""Bytes of an array that a loop reads or carries whole: several threads copy larger ones."""
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


def as_one_kernel(function: Callable[..., list[Array]]) -> Callable[..., list[Array]]:
    """The function as a call that XLA is asked to compile as one kernel, if that can be."""

    def call(*leaves: Array) -> list[Array]:
        return run_as_one_kernel(jax.make_jaxpr(function)(*leaves), leaves)

    return call


def run_as_one_kernel(
    traced: ClosedJaxpr,
    leaves: Sequence[Array],
    read: Callable[..., Sequence[Array]] = lambda *leaves: leaves,
) -> list[Array]:
    """A traced function of read(*leaves), where these are no random keys. No kernel is made where
    the user wants none: SWITCH is "off" when the function is traced."""
    switched_off = os.environ.get(SWITCH, "").lower() in ("off", "0", "no", "false")
    if switched_off or not _can_be_one(unclosed(traced)):
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
        corner = jax.lax.slice(leaf, [0] * leaf.ndim, [1] * leaf.ndim)  # of a table, not all of it
        first.setdefault(leaf.dtype, []).append(jnp.ravel(corner))
    return function(*leaves), [jnp.concatenate(parts) for parts in first.values()]


def _can_be_one(jaxpr: Jaxpr) -> bool:
    """True if nothing in there calls a library or needs more than loops over small arrays."""
    return all(map(_can_be_in_one, jaxpr.eqns))


def _bytes(atom: Atom) -> int:
    size, kind = getattr(atom.aval, "size", 0), getattr(atom.aval, "dtype", None)
    return size * getattr(kind, "itemsize", 1)


def _held_whole(loop: JaxprEqn, parts: Sequence[Jaxpr]) -> Sequence[Atom]:
    """Arguments that a loop reads or carries whole; a scan cuts slices out of the others."""
    if loop.primitive.name == "while":
        return loop.invars
    if loop.primitive.name != "scan":
        return ()
    both = zip(loop.invars, parts[0].invars, strict=True)
    shape = lambda atom: getattr(atom.aval, "shape", ())  # noqa: E731
    return [one for one, inside in both if shape(one) == shape(inside)]


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
    if any(_bytes(atom) >= LARGEST_CARRIED for atom in _held_whole(equation, jaxprs)):
        return False
    if name == "scan" and any(  # what is cut out of its arguments is an array of its own
        getattr(one.aval, "size", 0) > LARGEST_ARRAY for one in changing(equation, jaxprs[0])
    ):
        return False
    return all(map(_can_be_one, jaxprs))
