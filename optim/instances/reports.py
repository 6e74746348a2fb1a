"""Evaluations in other processes, counted where the objective was made.

In another process a copy of an objective returns numbers and arrays that take along, when they are
pickled, what was counted since the last. Unpickled at home, that is added to the record. So any map
over processes will do.
"""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import dataclass, field
from functools import wraps
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar, cast
from uuid import uuid4
from weakref import WeakValueDictionary

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence


F = TypeVar("F", bound="Callable[..., Any]")


class Seen(NamedTuple):
    """An evaluated point: what a record takes note of."""

    x: np.ndarray
    values: np.ndarray
    violation: float
    feasible: bool


@dataclass
class Home:
    """The process a record was made in, and what a copy elsewhere has not reported yet."""

    process: int = field(default_factory=os.getpid)
    name: str = field(default_factory=lambda: uuid4().hex)
    counts: Counter[str] = field(default_factory=Counter)
    seen: list[Seen] = field(default_factory=list)

    @property
    def here(self) -> bool:
        """True if this is the process."""
        return os.getpid() == self.process


class Counts(Protocol):
    """A record."""

    home: Home

    def take(self, counts: Mapping[str, int], seen: Sequence[Seen]) -> None:
        """Add what a copy in another process counted and saw."""


_made_here: WeakValueDictionary[str, Counts] = WeakValueDictionary()


def settle(record: Counts) -> None:
    """Give a new record, or a copy of one in its process, a name to report to."""
    record.home = Home()
    _made_here[record.home.name] = record


def reported(method: F) -> F:
    """The method of an Objective; what it returns away from home reports what was counted."""

    @wraps(method)
    def call(self: Any, *args: Any, **options: Any) -> Any:
        found = method(self, *args, **options)
        home = self.record.home
        return found if home.here else _reporting(found, home)

    return cast("F", call)


def _reporting(found: Any, home: Home) -> Any:
    if isinstance(found, tuple):
        return tuple(_reporting(one, home) for one in found)
    if isinstance(found, float):
        return ReportingNumber.of(found, home)
    array = np.asarray(found).view(ReportingArray)
    array.home = home
    return array


class ReportingNumber(float):
    """A float that reports."""

    home: Home

    @classmethod
    def of(cls, value: float, home: Home) -> ReportingNumber:
        """The number."""
        self = cls(value)
        self.home = home
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return reporting(float(self), self.home) or (float, (float(self),))


class ReportingArray(np.ndarray):
    """An array that reports; what is computed of it does not."""

    home: Home | None = None

    def __reduce_ex__(self, protocol: Any) -> Any:
        plain = np.array(self)
        return reporting(plain, self.home) or plain.__reduce_ex__(protocol)


def reporting(plain: Any, home: Home | None) -> tuple[Any, ...] | None:
    """Pickling of a value that reports; None where there is no home."""
    if home is None:
        return None
    counts, seen = home.counts, home.seen
    home.counts, home.seen = Counter(), []
    return _arrive, (plain, home.name, counts, seen)


def _arrive(value: Any, name: str, counts: Counter[str], seen: list[Seen]) -> Any:
    """The value, what was counted being added to the record, if that is here."""
    record = _made_here.get(name)
    if record is not None:
        record.take(counts, seen)
    return value
