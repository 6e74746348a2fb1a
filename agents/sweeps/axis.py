"""One axis of a sweep: which values a number takes."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from stickslip.agents.sweeps.names import FORMS, RANDOM
from stickslip.dynamics.checks import require_choice, require_integer, require_number, shown

MOST_VALUES = 10**5
"""Of one axis."""


@dataclass(frozen=True)
class Axis:
    """Values of an axis. Build it with `linear`, `log`, `listed`, `sobol`, `latin` or `parse`.

    kind: "grid", or how the values are drawn, "sobol" or "latin". values: of a grid. low, high: the
    range of random ones. logarithmic: whether they are even in the logarithm.
    """

    kind: str
    values: tuple[float, ...] = ()
    low: float = math.nan
    high: float = math.nan
    logarithmic: bool = False

    @classmethod
    def linear(cls, low: float, high: float, count: int) -> Axis:
        """`count` values, evenly from low to high."""
        _require_range(low, high, count)
        return cls._of(np.linspace(low, high, count))

    @classmethod
    def log(cls, low: float, high: float, count: int) -> Axis:
        """The same, evenly in the logarithm; low > 0."""
        _require_range(low, high, count)
        _require_positive(low)
        return cls._of(np.geomspace(low, high, count), logarithmic=True)

    @classmethod
    def listed(cls, values: Iterable[float]) -> Axis:
        """These values, in their order, each once."""
        given = np.atleast_1d(np.asarray(list(values)))
        require_number("values", given, accepted="finite numbers, at least one")
        if len(set(given.tolist())) < given.size:
            raise ValueError(f"values = {shown(given.tolist())}; accepted: each value once")
        return cls._of(given)

    @classmethod
    def sobol(cls, low: float, high: float, logarithmic: bool = False) -> Axis:
        """A coordinate of a scrambled Sobol sequence, from low to high."""
        return cls._drawn("sobol", low, high, logarithmic)

    @classmethod
    def latin(cls, low: float, high: float, logarithmic: bool = False) -> Axis:
        """A coordinate of a Latin hypercube, from low to high."""
        return cls._drawn("latin", low, high, logarithmic)

    @classmethod
    def parse(cls, text: str) -> Axis:
        """From a text, see FORMS. ValueError for any other."""
        parts = text.split(":")
        if len(parts) == 1:
            return cls.listed(_number(one, text) for one in text.split(","))
        if len(parts) not in (3, 4) or (len(parts) == 4 and parts[3] != "log"):
            raise ValueError(f"{shown(text)} is no axis; accepted: {FORMS}")
        low, high = (_number(one, text) for one in parts[:2])
        log = len(parts) == 4
        if parts[2] in RANDOM:
            return cls._drawn(parts[2], low, high, log)
        try:
            count = int(parts[2])
        except ValueError:
            raise ValueError(
                f"{shown(parts[2])} in {shown(text)} is neither a number of values nor one of "
                f"{', '.join(RANDOM)}; accepted: {FORMS}"
            ) from None
        return (cls.log if log else cls.linear)(low, high, count)

    @property
    def random(self) -> bool:
        """Whether its values are drawn."""
        return self.kind in RANDOM

    @property
    def ends(self) -> tuple[float, float]:
        """The least and the greatest value, or what they are drawn between."""
        return (self.low, self.high) if self.random else (min(self.values), max(self.values))

    def scaled(self, shares: np.ndarray) -> np.ndarray:
        """Random values from shares in [0, 1)."""
        if self.logarithmic:
            low, high = math.log(self.low), math.log(self.high)
            return np.exp(low + (high - low) * shares)
        return self.low + (self.high - self.low) * shares

    @classmethod
    def _of(cls, values: np.ndarray, logarithmic: bool = False) -> Axis:
        return cls("grid", tuple(float(one) for one in values), logarithmic=logarithmic)

    @classmethod
    def _drawn(cls, kind: str, low: float, high: float, logarithmic: bool) -> Axis:
        require_choice("kind", kind, RANDOM)
        _require_range(low, high, 2)
        if logarithmic:
            _require_positive(low)
        return cls(kind, low=float(low), high=float(high), logarithmic=logarithmic)


AxisLike: TypeAlias = "Axis | str | float | Iterable[float]"
"""What is taken for an axis: itself, its text, one value or several."""


def axis_of(name: str, given: AxisLike) -> Axis:
    """The axis itself, or from a text, a number or several. ValueError naming the axis."""
    try:
        if isinstance(given, Axis):
            return given
        if isinstance(given, str):
            return Axis.parse(given)
        if isinstance(given, int | float):
            return Axis.listed([given])
        if not isinstance(given, Iterable):
            raise ValueError(f"{shown(given)} is no axis; accepted: {FORMS}")
        return Axis.listed(given)
    except ValueError as error:
        raise ValueError(f"axis {name}: {error}") from error


def _number(text: str, whole: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(
            f"{shown(text)} in {shown(whole)} is no number; accepted: {FORMS}"
        ) from None


def _require_range(low: float, high: float, count: int) -> None:
    for name, value in (("low", low), ("high", high)):
        require_number(name, value, accepted="a finite number")
    require_integer("count", count, high=MOST_VALUES)
    if not (low < high and count > 1) and not (low == high and count == 1):
        raise ValueError(
            f"{count} value{'s' if count > 1 else ''} from {low:g} to {high:g}; accepted: low < "
            "high with at least 2, or one value"
        )


def _require_positive(low: float) -> None:
    if not low > 0:
        raise ValueError(f"low = {low:g} with logarithmic values; accepted: low > 0")
