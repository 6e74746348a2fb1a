"""A torque as arithmetic: text, parsed and held to a short list of what it may contain."""

from __future__ import annotations

import ast
import math
from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import nearest, shown

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Array, Float

    from stickslip.dynamics.biped import BipedState
    from stickslip.dynamics.numeric import Number

LONGEST, DEEPEST = 1000, 40
"""Characters, and arithmetic inside arithmetic."""
STATE: dict[str, Callable[[BipedState], Number]] = {
    "t": lambda state: state.time,
    "phase": lambda state: state.phase,
    "crank_angle": lambda state: state.crank_angle,
    "crank_rate": lambda state: state.crank_rate,
    "foot_position": lambda state: state.foot_position,
    "foot_velocity": lambda state: state.foot_velocity,
    "steps": lambda state: state.steps,
}
"""Variables along a walk."""
CONSTANTS = {"pi": math.pi}
ONE = ("sin", "cos", "tan", "tanh", "exp", "log", "sqrt", "abs", "sign", "floor")
FUNCTIONS = dict.fromkeys(ONE, 1) | {"min": 2, "max": 2, "clip": 3}
"""Number of arguments."""
NUMPY = {"min": "minimum", "max": "maximum"}
"""Names of functions in NumPy and JAX, where they differ."""
OPERATORS: dict[type[ast.AST], str] = {
    ast.Add: "add",
    ast.Sub: "subtract",
    ast.Mult: "multiply",
    ast.Div: "divide",
    ast.Mod: "mod",
    ast.Pow: "power",
    ast.UAdd: "positive",
    ast.USub: "negative",
    ast.Lt: "less",
    ast.LtE: "less_equal",
    ast.Gt: "greater",
    ast.GtE: "greater_equal",
    ast.And: "logical_and",
    ast.Or: "logical_or",
    ast.Not: "logical_not",
}
"""Names in NumPy and JAX."""
ACCEPTED = (
    f"arithmetic of numbers, {', '.join((*STATE, *CONSTANTS))}, with + - * / % **, comparisons, "
    f"`a if c else b` and {', '.join(FUNCTIONS)}"
)


@dataclass(frozen=True)
class Expression:
    """A torque [N m] of a BipedState, for `simulate`: "0.8 + 0.3 * sin(2 * crank_angle)".

    Hashable by its text, so that the same text is compiled once. ValueError for text that is no
    such arithmetic, which nothing of is ever run: the parts are looked up, one by one; and for a
    part without a variable that is not finite.
    """

    text: str

    def __post_init__(self):
        with np.errstate(all="ignore"):
            _require(_parsed(self.text), self.text, 0)

    def __call__(self, state: BipedState) -> Float[Array, ""]:
        """The torque in a state."""
        known = {name: jnp.asarray(of(state)) for name, of in STATE.items()}
        dtype = known["phase"].dtype
        names = {name: value.astype(dtype) for name, value in known.items()}
        names |= {name: jnp.asarray(value, dtype) for name, value in CONSTANTS.items()}

        def value(node: ast.AST) -> Array:
            match node:
                case ast.Name(id=name):
                    return names[name]
                case ast.Constant(value=int() | float() as number):
                    with np.errstate(over="ignore"):  # in single precision: a status tells
                        return jnp.asarray(np.asarray(float(number), dtype))
            return _combined(node, [value(part) for part in _parts(node) or ()], jnp)

        return jnp.asarray(value(_parsed(self.text)), dtype)


def _parsed(text: str) -> ast.expr:
    if len(text) > LONGEST:
        raise ValueError(f"torque of {len(text)} characters; accepted: up to {LONGEST}")
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        why = error.msg if isinstance(error, SyntaxError) else str(error)
        raise ValueError(f"torque {shown(text)}: {why}; accepted: {ACCEPTED}") from None


def _require(node: ast.AST, text: str, depth: int) -> Any:
    """ValueError for the first part that is not accepted; the value of one that is constant."""
    if depth > DEEPEST:
        raise ValueError(f"torque {shown(text)} is nested deeper than {DEEPEST}; accepted: less")
    parts = _parts(node)
    if parts is None:
        raise ValueError(f"torque {shown(text)}: {_said(node)}; accepted: {ACCEPTED}")
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Name(id=name):
            return CONSTANTS.get(name)
    values = [_require(part, text, depth + 1) for part in parts]
    known = next((place for place, value in enumerate(values) if value is None), len(values))
    if known < min(2, len(values)) or (known < len(values) and not isinstance(node, ast.BinOp)):
        return None
    found = _combined(node, values[:known], np)
    if not np.isfinite(found):
        raise ValueError(
            f"torque {shown(text)}: {shown(ast.unparse(node))} comes to {float(found)}; accepted: "
            "constants that are finite"
        )
    return found if known == len(values) else None


def _parts(node: ast.AST) -> list[ast.AST] | None:
    """Children of a node; None for one that is not accepted."""
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return [] if _finite(value) else None
        case ast.Name(id=name) if name in STATE or name in CONSTANTS:
            return []
        case ast.BinOp() if all(type(op) in OPERATORS for op in _chain(node)[1]):
            return list(_chain(node)[0])
        case ast.UnaryOp(op=op, operand=a) if type(op) in OPERATORS:
            return [a]
        case ast.BoolOp(values=values):
            return list(values)
        case ast.Compare(left=a, ops=[op], comparators=[b]) if type(op) in OPERATORS:
            return [a, b]
        case ast.IfExp(test=test, body=a, orelse=b):
            return [test, a, b]
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in FUNCTIONS:
            return list(args) if len(args) == FUNCTIONS[name] else None
    return None


def _chain(node: ast.BinOp) -> tuple[list[ast.expr], list[ast.operator]]:
    """Of a + b - c: its parts, and + and -. Long sums are as deep as short ones."""
    parts, operators = [], []
    left: ast.expr = node
    while isinstance(left, ast.BinOp):
        parts.append(left.right)
        operators.append(left.op)
        left = left.left
    return [left, *reversed(parts)], operators[::-1]


def _finite(value: float) -> bool:
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False


def _said(node: ast.AST) -> str:
    """Message about a node that is not accepted."""
    match node:
        case ast.Name(id=name):
            return f"{shown(name)} is unknown{nearest(name, (*STATE, *CONSTANTS, *FUNCTIONS))}"
        case ast.Call(func=ast.Name(id=name), args=args):
            if name in FUNCTIONS:
                count = FUNCTIONS[name]
                given = ", ".join(f"{one.arg}=" for one in node.keywords) or len(args)
                return f"{name} takes {count} value{'s' if count > 1 else ''}, not {given}"
            return f"{shown(name)} is no function here{nearest(name, FUNCTIONS)}"
        case ast.Constant(value=value):
            return f"{shown(value)} is no finite number"
    return f"{shown(ast.unparse(node))} is not accepted"


def _combined(node: ast.AST, values: list[Any], of: Any) -> Any:
    """A part's value from those of its parts, or of the first parts of a sum. of: NumPy or JAX."""
    match node:
        case ast.BinOp():
            found = values[0]
            for op, value in zip(_chain(node)[1], values[1:], strict=False):
                found = getattr(of, OPERATORS[type(op)])(found, value)
            return found
        case ast.BoolOp(op=op):
            return reduce(getattr(of, OPERATORS[type(op)]), values)
        case ast.UnaryOp(op=op) | ast.Compare(ops=[op]):
            return getattr(of, OPERATORS[type(op)])(*values)
        case ast.IfExp():
            return of.where(*values)
        case ast.Call(func=ast.Name(id=name)):
            return getattr(of, NUMPY.get(name, name))(*values)
    raise ValueError(_said(node))
