"""Bad values, what an argument may accept of them, and calls to try them on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

BAD: dict[str, Any] = {
    "huge": 10**400,
    "minus huge": -(10**400),
    "overflow": 1e39,
    "nan": np.nan,
    "inf": np.inf,
    "-inf": -np.inf,
    "minus one": -1.0,
    "half": 0.5,
    "subnormal": 1e-320,
    "true": True,
    "none": None,
    "text": "1.0",
    "word": "nonsense",
    "bytes": b"1",
    "complex": 1j,
    "empty list": [],
    "list of none": [None],
    "ragged": [[1.0], [1.0, 2.0]],
    "pair": (1.0, 2.0),
    "dict": {},
    "set": {1.0},
    "object": object(),
    "type": float,
    "function": lambda: 1.0,
    "array of text": np.asarray(["a"]),
    "array of objects": np.asarray([None]),
    "empty array": np.zeros(0),
    "other shape": np.ones((2, 3)),
    "date": np.datetime64("2020-01-01"),
}

REAL = ("minus one", "half", "subnormal", "pair", "other shape")
ABOVE = ("half", "pair", "other shape")
NOT_BELOW = ("half", "subnormal", "pair", "other shape")
ONE = ("half",)
HAND = ("half", "other shape")
BATCHES = ("pair", "other shape")
"""Legitimate for a robot, too; each would compile dozens of programs."""
ANY_ONE = ("minus one", "half", "subnormal")
INTEGER = CHOICE = KIND = ()
FLAG = ("true",)
RANGE = ("pair", "none")
ANYTHING = ("half", "subnormal", "overflow", "true", "none", "pair", "text", "word")


def maybe(*accepted: str) -> tuple[str, ...]:
    """The same, or None."""
    return (*accepted, "none")


class Plan(NamedTuple):
    """A call, what each of its arguments accepts out of BAD, and what the others are."""

    call: Callable[..., Any]
    accepts: dict[str, tuple[str, ...]]
    base: dict[str, Any] = {}  # noqa: RUF012
    says: dict[str, str] = {}  # noqa: RUF012
    """The word for an argument in messages, where it is not its name."""
    skips: tuple[str, ...] = ()
    """Values that are not tried, as each is legitimate and a program of its own."""
    of: Callable[..., Any] | None = None
    """What has the signature, where `call` is a lambda around it."""
