"""Forms of `--torque` (a number, a file of times and torques, or arithmetic of the state) and of
`--rate` (a crank rate, or a file of crank rates over time or over the crank angle)."""

from __future__ import annotations

import ast
import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START, BipedState
from stickslip.dynamics.checks import nearest, require_number, shown
from stickslip.optim.columns import TIME, TORQUE, ColumnSpec, is_number, read_columns, read_text

if TYPE_CHECKING:
    from jaxtyping import Array, Float

LONGEST_NAME = 255
"""Characters: what is longer is no file's name for any system."""
COLUMNS = (TIME, TORQUE)
LONGEST, DEEPEST = 1000, 40
"""Characters of arithmetic, and levels of it."""
LARGEST = sys.float_info.max
STATE = {"t": "time"} | {
    name: name
    for name in ("phase", "crank_angle", "crank_rate", "foot_position", "foot_velocity", "steps")
}
"""Variables along a walk, and the fields of BipedState that they are."""
CONSTANTS = {"pi": math.pi}
ONE = ("sin", "cos", "tan", "tanh", "exp", "log", "sqrt", "abs", "sign", "floor")
FUNCTIONS = dict.fromkeys(ONE, 1) | {"min": 2, "max": 2, "clip": 3}
"""Number of arguments."""
NUMPY = {"min": "minimum", "max": "maximum"}
"""Names of functions in NumPy and JAX, where they differ."""
OPERATORS: dict[type[ast.AST], str] = {ast.Add: "add", ast.Sub: "subtract", ast.Mult: "multiply"}
OPERATORS |= {ast.Div: "divide", ast.Mod: "mod", ast.Pow: "power"}
OPERATORS |= {ast.UAdd: "positive", ast.USub: "negative"}
OPERATORS |= {ast.Lt: "less", ast.LtE: "less_equal", ast.Gt: "greater", ast.GtE: "greater_equal"}
"""Names in NumPy and JAX."""
ACCEPTED = (
    f"arithmetic of numbers, {', '.join((*STATE, *CONSTANTS))}, with + - * / % **, comparisons, "
    f"`a if c else b` and {', '.join(FUNCTIONS)}"
)


@dataclass(frozen=True)
class Recorded:
    """Torques [N m] or other values at times [s], straight between them."""

    name: str
    times: Float[np.ndarray, " n"]
    values: Float[np.ndarray, " n"]
    words: str = "torques"

    def __post_init__(self):
        if len(self.times) < 2:
            raise ValueError(f"{self.name} has one row of {self.words}; accepted: two and more")

    @property
    def end(self) -> float:
        """The last time [s]."""
        return float(self.times[-1])

    def at(self, times: Float[np.ndarray, " m"]) -> Float[np.ndarray, " m"]:
        """The values at other times. ValueError beyond the first and the last one."""
        slack = 1e-9 * max(1.0, abs(self.end))
        if self.times[0] > times[0] + slack or self.end < times[-1] - slack:
            raise ValueError(
                f"{self.name} has {self.words} from {self.times[0]:g} to {self.end:g} s, and the "
                f"walk asks for them from {times[0]:g} to {times[-1]:g} s; accepted: a file of all "
                "these times, or a shorter walk (--seconds)"
            )
        return np.interp(times, self.times, self.values)


def torque_of(text: str) -> float | Expression | Recorded:
    """A number [N m], what is in a file, or arithmetic; ValueError for what is none of these."""
    path = Path(text)
    if is_number(text):
        require_number("torque", float(text), accepted="a finite torque [N m]")
        return float(text)
    if not text.strip():
        raise ValueError(f"the torque is empty; accepted: a number [N m], a file, or {ACCEPTED}")
    if path.suffix.lower() == ".csv":
        times, torques = read_columns(path, COLUMNS).T
        return Recorded(str(path), times, torques)
    if len(text) < LONGEST_NAME and path.exists():
        raise ValueError(
            f"torque {shown(text)} is a {'folder' if path.is_dir() else 'file'}; accepted: a .csv"
        )
    return Expression(text)


@dataclass(frozen=True)
class Expression:
    """A torque [N m] of a BipedState, for `simulate`: "0.8 + 0.3 * sin(2 * crank_angle)".

    Hashable by its text, so that the same text is compiled once. Nothing of the text is ever run:
    its parts are looked up, one by one; ValueError for others than ACCEPTED. limit: where the
    torque saturates [N m].
    """

    text: str
    limit: float = math.inf

    def __post_init__(self):
        if len(self.text) > LONGEST:
            raise ValueError(f"torque of {len(self.text)} characters; accepted: up to {LONGEST}")
        names = dict.fromkeys(STATE, 1.0) | CONSTANTS
        try:
            with np.errstate(all="ignore"):
                _value(self._parsed(), names, np)
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            why = error.msg if isinstance(error, SyntaxError) else str(error)
            raise ValueError(f"torque {shown(self.text)}: {why}; accepted: {ACCEPTED}") from None

    def __call__(self, state: BipedState) -> Float[Array, ""]:
        """The torque in a state."""
        dtype = jnp.asarray(state.phase).dtype
        names = {name: jnp.asarray(getattr(state, of), dtype) for name, of in STATE.items()}
        names |= {name: jnp.asarray(value, dtype) for name, value in CONSTANTS.items()}
        torque = jnp.asarray(_value(self._parsed(), names, jnp), dtype)
        return torque if self.limit == math.inf else jnp.clip(torque, -self.limit, self.limit)

    def _parsed(self) -> ast.expr:
        return ast.parse(self.text.strip(), mode="eval").body


def _value(node: ast.AST, names: Mapping[str, Any], library: Any, depth: int = 0) -> Any:
    """Value of a node with the functions of NumPy or JAX; ValueError for one not accepted."""
    if depth > DEEPEST:
        raise ValueError(f"it is nested deeper than {DEEPEST}")

    def values(*parts: ast.AST) -> list[Any]:
        return [_value(part, names, library, depth + 1) for part in parts]

    match node:
        case ast.Constant(value=bool()):
            pass
        case ast.Constant(value=int() | float() as number) if abs(number) <= LARGEST:
            return library.asarray(float(number), library.asarray(names["pi"]).dtype)
        case ast.Name(id=name) if name in names:
            return names[name]
        case ast.BinOp(left=a, op=op, right=b) if type(op) in OPERATORS:
            return getattr(library, OPERATORS[type(op)])(*values(a, b))
        case ast.UnaryOp(op=op, operand=a) if type(op) in OPERATORS:
            return getattr(library, OPERATORS[type(op)])(*values(a))
        case ast.Compare(left=a, ops=[op], comparators=[b]) if type(op) in OPERATORS:
            return getattr(library, OPERATORS[type(op)])(*values(a, b))
        case ast.IfExp(test=test, body=a, orelse=b):
            return library.where(*values(test, a, b))
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if FUNCTIONS.get(name) == len(
            args
        ):
            return getattr(library, NUMPY.get(name, name))(*values(*args))
    raise ValueError(_refusal(node))


def _refusal(node: ast.AST) -> str:
    """Message about a node that is not accepted."""
    name = node.func if isinstance(node, ast.Call) else node
    if not isinstance(name, ast.Name):
        return f"{shown(ast.unparse(node))} is not accepted"
    if count := FUNCTIONS.get(name.id):
        return f"{name.id} takes {count} value{'s' if count > 1 else ''}"
    return f"{shown(name.id)} is unknown{nearest(name.id, (*STATE, *CONSTANTS, *FUNCTIONS))}"


RATE = ColumnSpec("crank rate", "rad/s", ("rate", "w"))
PHASE = ColumnSpec("crank angle", "rad", ("phase", "theta"))
NODES = 4001
"""Crank angles of a step at which the time is known."""
SAME = 1e-6
"""Relative difference of crank rates that are the same, and of an angle to the end of its range."""


@dataclass(frozen=True)
class PhaseRates:
    """Crank rates [rad/s] at crank angles of the supporting leg [rad], linear between, periodic."""

    angles: Float[np.ndarray, " n"]
    rates: Float[np.ndarray, " n"]

    def at(self, times: Float[np.ndarray, " m"], phase: float) -> Float[np.ndarray, " m"]:
        """The rates at times from a phase on."""
        nodes = np.linspace(SUPPORT_START, SUPPORT_END, NODES)
        rates = np.interp(nodes, self.angles, self.rates, period=np.pi)
        clock = np.append(0.0, np.cumsum(np.diff(nodes) * (1 / rates[1:] + 1 / rates[:-1]) / 2))
        now = np.mod(times + np.interp(phase, nodes, clock), clock[-1])
        return np.interp(now, clock, rates)


Rate = float | Recorded | PhaseRates


def rate_of(text: str) -> Rate:
    """A number [rad/s], or what is in a file. ValueError for what is neither."""
    path = Path(text)
    if is_number(text):
        require_number("rate", float(text), accepted="a finite crank rate [rad/s]")
        return float(text)
    if path.suffix.lower() != ".csv":
        raise ValueError(
            f"rate {shown(text)}; accepted: a number [rad/s], or a .csv of crank rates over "
            "time or crank angle"
        )
    head = read_text(path, "a table")[:1000].lower()
    if not any(word in head for word in ("phase", "angle", "theta")):
        times, rates = read_columns(path, (TIME, RATE)).T
        return Recorded(str(path), times, rates, "rates")
    angles, rates = read_columns(path, (PHASE, RATE)).T
    low, high = SUPPORT_START * (1 - SAME), SUPPORT_END * (1 + SAME)
    name, accepted = f"{path}: crank angle", "pi/2 to 3 pi/2 [rad], one step"
    require_number(name, angles, low=low, high=high, accepted=accepted)
    accepted = "above 0 [rad/s], so that the step ends"
    require_number(f"{path}: crank rate", rates, low=0.0, strict=True, accepted=accepted)
    whole = np.ptp(angles) > np.pi * (1 - SAME)
    if whole and abs(rates[-1] - rates[0]) > SAME * rates[0]:
        raise ValueError(
            f"{path}: {rates[-1]:g} rad/s at 3 pi/2 and {rates[0]:g} at pi/2; accepted: the same "
            "rate, which an exchange of support cannot change"
        )
    return PhaseRates(angles[:-1] if whole else angles, rates[:-1] if whole else rates)


def rates_at(rate: Rate, times: Float[np.ndarray, " m"], phase: float) -> Float[np.ndarray, " m"]:
    """The crank rates at times, from a phase on [rad/s]. ValueError beyond a file's."""
    if isinstance(rate, Recorded):
        return rate.at(times)
    return rate.at(times, phase) if isinstance(rate, PhaseRates) else np.full(len(times), rate)
