"""Evaluations in other processes, counted in the record of the process that an objective is of.

In another process a copy of an objective returns arrays that carry, when they are pickled, what the
copy counted since the last. Unpickled in the first process, that is added to the record. So any map
over processes will do.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from functools import wraps
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, cast
from uuid import uuid4
from weakref import WeakValueDictionary

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

F = TypeVar("F", bound="Callable[..., Any]")

RECORDS: WeakValueDictionary[str, Any] = WeakValueDictionary()
"""The records of this process by the names of their homes."""


class Evaluated(NamedTuple):
    """A point that was evaluated: what a record takes note of."""

    x: np.ndarray
    values: np.ndarray
    violation: float
    feasible: bool


@dataclass
class Home:
    """The process that a record is of, and what a copy elsewhere has not reported yet."""

    process: int = field(default_factory=os.getpid)
    name: str = field(default_factory=lambda: uuid4().hex)
    counts: dict[str, int] = field(default_factory=dict)
    points: list[Evaluated] = field(default_factory=list)

    @property
    def here(self) -> bool:
        """True in the record's own process."""
        return os.getpid() == self.process


def reported(method: F) -> F:
    """The method of an Objective; in another process what it returns carries the counts."""

    @wraps(method)
    def call(self: Any, *args: Any, **options: Any) -> Any:
        found = method(self, *args, **options)
        home = self.record.home
        if home.here:
            return found
        if isinstance(found, tuple):
            return tuple(_carrying(one, home) for one in found)
        return _carrying(found, home)

    return cast("F", call)


class Report(np.ndarray):
    """A number or array that carries counts when it is pickled; what is computed of it does not."""

    home: Home | None = None

    def __reduce_ex__(self, protocol: Any) -> Any:
        plain = np.array(self) if self.ndim else float(self)
        return arriving(plain, self.home) if self.home else (np.array, (plain,))


def arriving(plain: Any, home: Home) -> tuple[Any, ...]:
    """Pickling of a value with the counts of a copy, which are then reported."""
    counts, points = home.counts, home.points
    home.counts, home.points = {}, []
    return _arrive, (plain, home.name, counts, points)


def _carrying(found: Any, home: Home) -> Report:
    report = np.asarray(found).view(Report)
    report.home = home
    return report


def _arrive(value: Any, name: str, counts: dict[str, int], points: list[Evaluated]) -> Any:
    """The value; what was counted is added to the record, if that is here."""
    if (record := RECORDS.get(name)) is not None:
        record.add(counts, points)
    return value
