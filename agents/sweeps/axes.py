"""The points of a sweep: the grid of its axes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from stickslip.dynamics.checks import require_kind, require_number, shown

RANGE = re.compile(r"([^:]+):([^:]+):(\d{1,6})(:log)?")
FORMS = "LOW:HIGH:N (even), LOW:HIGH:N:log, or values as 0.1,0.2,0.5"

AxisLike: TypeAlias = "str | float | Iterable[float]"
"""Accepted forms of an axis: its text, one value or several."""


def axis_values(given: AxisLike) -> tuple[float, ...]:
    """The values of an axis from a text (see FORMS), a number or several. ValueError otherwise."""
    if isinstance(given, str) and ":" in given:
        return _range(given)
    if isinstance(given, str):
        given = [_number(one, given) for one in given.split(",")]
    values = np.atleast_1d(np.asarray(list(given) if isinstance(given, Iterable) else given))
    require_number("values", values, accepted="finite numbers, at least one")
    if len(set(values.tolist())) < values.size:
        raise ValueError(f"values = {shown(values.tolist())}; accepted: each value once")
    return tuple(map(float, values))


def _range(text: str) -> tuple[float, ...]:
    found = RANGE.fullmatch(text)
    if found is None:
        raise ValueError(f"{shown(text)} is no axis; accepted: {FORMS}")
    low, high, log = _number(found[1], text), _number(found[2], text), bool(found[4])
    count = int(found[3])
    if not -math.inf < low < high < math.inf or (log and low <= 0) or count < 2:
        raise ValueError(
            f"{shown(text)}; accepted: finite LOW < HIGH, LOW > 0 with log, 2 values or more"
        )
    return tuple((np.geomspace if log else np.linspace)(low, high, count).tolist())


def _number(text: str, whole: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(
            f"{shown(text)} in {shown(whole)} is no number; accepted: {FORMS}"
        ) from None


@dataclass(frozen=True)
class Design:
    """Points by a flat index: axes in their order, the last one fastest. axes: values by name."""

    axes: dict[str, tuple[float, ...]]

    @classmethod
    def of(cls, axes: Mapping[str, AxisLike]) -> Design:
        """Check axes. ValueError naming the axis."""
        require_kind("axes", axes, Mapping, 'a dict of axes by name, {"mu": "0.02:0.3:64"} or such')
        found = {}
        for name, given in axes.items():
            try:
                found[str(name)] = axis_values(given)
            except ValueError as error:
                raise ValueError(f"axis {name}: {error}") from error
        return cls(found)

    @property
    def points(self) -> int:
        """Number of points; 1 without axes."""
        return math.prod(map(len, self.axes.values()))

    def at(self, points: np.ndarray) -> dict[str, np.ndarray]:
        """The axes' values at points by their flat indices, in float64."""
        places = np.unravel_index(points, tuple(map(len, self.axes.values())) or (1,))
        return {
            name: np.asarray(values)[place]
            for (name, values), place in zip(self.axes.items(), places, strict=False)
        }

    def describe(self) -> dict[str, object]:
        """Everything as JSON values, in the format that sweeps of version 3 are resumed by."""
        axes = {name: {"kind": "grid", "values": list(one)} for name, one in self.axes.items()}
        return {"axes": axes, "samples": 0, "design_seed": 0}
