"""The cheapest measured setting for a tolerance, for both machines."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

if TYPE_CHECKING:
    from collections.abc import Iterable


class Point(Protocol):
    """A measured setting: its batch, cost and the error that it promises."""

    @property
    def batch(self) -> int: ...
    @property
    def cost(self) -> float: ...
    @property
    def promised_error(self) -> float: ...


Measured = TypeVar("Measured", bound=Point)


def measured_beside(file: str) -> dict[str, Any]:
    """The measurements in the file `measured.json` in a module's folder."""
    return json.loads(Path(file).with_name("measured.json").read_text(encoding="utf-8"))


def in_nearest_batch(points: Iterable[Measured], batch: int) -> list[Measured]:
    """Those measured in the batch whose size is nearest by ratio."""
    points = list(points)
    nearest = min({p.batch for p in points}, key=lambda b: abs(math.log(b / batch)), default=0)
    return [point for point in points if point.batch == nearest]


def cheapest(points: list[Measured], tolerance: float, refusal: str, none: str = "") -> Measured:
    """The cheapest point whose promised error is within the tolerance.

    ValueError with the best promise where there is none: refusal, the message so far; none: what is
    accepted where there are no points at all.
    """
    good = [point for point in points if point.promised_error <= tolerance]
    if good:
        return min(good, key=lambda point: (point.cost, point.promised_error))
    accepted = none
    if points:
        best = min(points, key=lambda point: point.promised_error)
        accepted = f"from {best.promised_error:.2g}"
    raise ValueError(f"tolerance = {tolerance:g}: {refusal}; accepted: {accepted}")
