"""Checks of names, kinds and sizes given by a user, and the words of a refusal.

The part of checks.py that needs the standard library only: what is registered and the command
line's help are made with it, and neither waits for JAX.
"""

from __future__ import annotations

import math
import os
import reprlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable

MEMORY_LIMIT = "STICKSLIP_MEMORY_LIMIT"
"""The environment variable that holds the most bytes that one request may need."""
DEFAULT_MEMORY_LIMIT = 4 * 2**30
"""Bytes, where the variable is not set."""
SMALL_SIZES = 10**6
"""Whole numbers beyond this are shown by their magnitude."""

_short = reprlib.Repr()
_short.maxstring = _short.maxother = _short.maxlong = 60
_short.maxlist = _short.maxtuple = _short.maxdict = _short.maxarray = 6


def shown(value: object) -> str:
    """The value for a message: its repr on one line, shortened where it is long."""
    text = " ".join(_short.repr(value).split())
    return text if len(text) <= 120 else f"{text[:100]} ... ({len(text)} characters)"


def require_choice(name: str, value: Any, choices: Iterable[str], *, also: str = "") -> None:
    """Raise ValueError unless `value` is one of `choices`, with the nearest of them.

    also: what else the caller accepts, for the message.
    """
    known = tuple(choices)
    if not isinstance(value, str) or value not in known:
        raise ValueError(
            f"{name} = {shown(value)} is unknown; accepted: "
            f"{', '.join([*([also] if also else []), *map(repr, known)])}{nearest(value, known)}"
        )


def require_known(names: Iterable[str], known: Iterable[str], what: str = "field") -> None:
    """Raise ValueError for the first name that is not known: all that are, and the nearest."""
    known = tuple(known)
    for name in names:
        if name not in known:
            raise ValueError(
                f"{shown(name)} is no {what}; accepted: {', '.join(known) or 'none'}"
                f"{nearest(name, known)}"
            )


def require_kind(name: str, value: Any, kinds: type | tuple[type, ...], accepted: str) -> None:
    """Raise ValueError unless `value` is an instance of one of the classes."""
    if not isinstance(value, kinds):
        raise ValueError(f"{name} = {shown(value)}; accepted: {accepted}")


def nearest(value: object, known: Iterable[str]) -> str:
    """' (did you mean ...?)' for a name that looks like a known one or begins one, else ''."""
    if not isinstance(value, str):
        return ""
    import difflib

    given, names = value[:200].lower(), tuple(known)
    near = difflib.get_close_matches(given, names, n=1)
    near = near or [name for name in names if len(given) > 2 and name.startswith(given)]
    return f" (did you mean {near[0]}?)" if near else ""


def memory_limit() -> float:
    """The most bytes that one request may need: MEMORY_LIMIT, or the default."""
    given = os.environ.get(MEMORY_LIMIT)
    if given is None:
        return DEFAULT_MEMORY_LIMIT
    try:
        limit = float(given)
    except ValueError:
        limit = math.nan
    if not limit > 0:
        raise ValueError(f"{MEMORY_LIMIT} = {shown(given)}; accepted: a number of bytes > 0")
    return limit


def require_memory(given: str, what: str, count: float, bytes_each: float) -> None:
    """Raise ValueError where `count` things of so many bytes would not fit the memory limit.

    Call it before anything of that size exists. given: the argument at fault with its value, as
    "spacing = 1e-09"; what: the things, as "waypoints". count: a float may be infinite.
    """
    try:
        needed = float(count) * float(bytes_each)
    except OverflowError:  # an integer that no float holds
        count = needed = float("inf")
    limit = memory_limit()
    if not needed <= limit:
        number = f"{int(count):,}" if count <= SMALL_SIZES else f"{count:.3g}"
        raise ValueError(
            f"{given} makes {number} {what}, about {needed:.2g} bytes; accepted: what fits "
            f"{limit:.3g} bytes (set the environment variable {MEMORY_LIMIT} for more)"
        )
