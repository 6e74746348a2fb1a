"""A torque as arithmetic: text, parsed and held to a short list of what it may contain."""

from __future__ import annotations

import ast
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import nearest, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

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
"""What changes along a walk."""
CONSTANTS = {"pi": math.pi}
FUNCTIONS: dict[str, tuple[int, Callable[..., Array]]] = {
    "sin": (1, jnp.sin),
    "cos": (1, jnp.cos),
    "tan": (1, jnp.tan),
    "tanh": (1, jnp.tanh),
    "exp": (1, jnp.exp),
    "log": (1, jnp.log),
    "sqrt": (1, jnp.sqrt),
    "abs": (1, jnp.abs),
    "sign": (1, jnp.sign),
    "floor": (1, jnp.floor),
    "min": (2, jnp.minimum),
    "max": (2, jnp.maximum),
    "clip": (3, jnp.clip),
}
"""Number of arguments, and what computes them."""
OPERATORS: dict[type[ast.AST], Callable[..., Array]] = {
    ast.Add: jnp.add,
    ast.Sub: jnp.subtract,
    ast.Mult: jnp.multiply,
    ast.Div: jnp.divide,
    ast.Mod: jnp.mod,
    ast.Pow: jnp.power,
    ast.UAdd: jnp.positive,
    ast.USub: jnp.negative,
    ast.Lt: jnp.less,
    ast.LtE: jnp.less_equal,
    ast.Gt: jnp.greater,
    ast.GtE: jnp.greater_equal,
    ast.And: jnp.logical_and,
    ast.Or: jnp.logical_or,
    ast.Not: jnp.logical_not,
}
ACCEPTED = (
    f"arithmetic of numbers, {', '.join((*STATE, *CONSTANTS))}, with + - * / % **, comparisons, "
    f"`a if c else b` and {', '.join(FUNCTIONS)}"
)


@dataclass(frozen=True)
class Expression:
    """A torque [N m] of a BipedState, for `simulate`: "0.8 + 0.3 * sin(2 * crank_angle)".

    Hashable by its text, so that the same text is compiled once. ValueError for text that is no
    such arithmetic, which nothing of is ever run: the parts are looked up, one by one.
    """

    text: str

    def __post_init__(self):
        tree = _parsed(self.text)
        _require(tree, self.text, 0)

    def __call__(self, state: BipedState) -> Float[Array, ""]:
        """The torque in a state."""
        known = {name: jnp.asarray(of(state)) for name, of in STATE.items()}
        dtype = known["phase"].dtype
        names = {name: value.astype(dtype) for name, value in known.items()}
        names |= {name: jnp.asarray(value, dtype) for name, value in CONSTANTS.items()}
        return jnp.asarray(_value(_parsed(self.text), names, dtype), dtype)


def _parsed(text: str) -> ast.expr:
    if len(text) > LONGEST:
        raise ValueError(f"torque of {len(text)} characters; accepted: up to {LONGEST}")
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        why = error.msg if isinstance(error, SyntaxError) else str(error)
        raise ValueError(f"torque {shown(text)}: {why}; accepted: {ACCEPTED}") from None


def _require(node: ast.AST, text: str, depth: int) -> None:
    """ValueError for the first part that is not accepted."""
    if depth > DEEPEST:
        raise ValueError(f"torque {shown(text)} is nested deeper than {DEEPEST}; accepted: less")
    parts = _parts(node)
    if parts is None:
        raise ValueError(f"torque {shown(text)}: {_said(node)}; accepted: {ACCEPTED}")
    for part in parts:
        _require(part, text, depth + 1)


def _parts(node: ast.AST) -> list[ast.AST] | None:
    """What a part is made of; None for one that is not accepted."""
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return [] if _finite(value) else None
        case ast.Name(id=name) if name in STATE or name in CONSTANTS:
            return []
        case ast.BinOp(left=a, op=op, right=b) if type(op) in OPERATORS:
            return [a, b]
        case ast.UnaryOp(op=op, operand=a) if type(op) in OPERATORS:
            return [a]
        case ast.BoolOp(values=values):
            return list(values)
        case ast.Compare(left=a, ops=[op], comparators=[b]) if type(op) in OPERATORS:
            return [a, b]
        case ast.IfExp(test=test, body=a, orelse=b):
            return [test, a, b]
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in FUNCTIONS:
            return list(args) if len(args) == FUNCTIONS[name][0] else None
    return None


def _finite(value: float) -> bool:
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False


def _said(node: ast.AST) -> str:
    """What is wrong with a part."""
    match node:
        case ast.Name(id=name):
            return f"{shown(name)} is unknown{nearest(name, (*STATE, *CONSTANTS, *FUNCTIONS))}"
        case ast.Call(func=ast.Name(id=name), args=args):
            if name in FUNCTIONS:
                return f"{name} takes {FUNCTIONS[name][0]} values, not {len(args)}"
            return f"{shown(name)} is no function here{nearest(name, FUNCTIONS)}"
        case ast.Constant(value=value):
            return f"{shown(value)} is no finite number"
    return f"{shown(ast.unparse(node))} is not accepted"


def _value(node: ast.AST, names: Mapping[str, Array], dtype: np.dtype) -> Array:
    """The value of what `_require` has passed."""

    def of(part: ast.AST) -> Array:
        return _value(part, names, dtype)

    match node:
        case ast.Constant(value=int() | float() as value):
            return jnp.asarray(float(value), dtype)
        case ast.Name(id=name):
            return names[name]
        case ast.BinOp(left=a, op=op, right=b):
            return OPERATORS[type(op)](of(a), of(b))
        case ast.UnaryOp(op=op, operand=a):
            return OPERATORS[type(op)](of(a))
        case ast.BoolOp(op=op, values=values):
            found = of(values[0])
            for value in values[1:]:
                found = OPERATORS[type(op)](found, of(value))
            return found
        case ast.Compare(left=a, ops=[op], comparators=[b]):
            return OPERATORS[type(op)](of(a), of(b))
        case ast.IfExp(test=test, body=a, orelse=b):
            return jnp.where(of(test), of(a), of(b))
        case ast.Call(func=ast.Name(id=name), args=args):
            return FUNCTIONS[name][1](*map(of, args))
    raise ValueError(_said(node))
