"""The cheapest measured setting for a tolerance, for both machines."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any


def measured_beside(file: str) -> dict[str, Any]:
    """The measurements in the file `measured.json` in a module's folder."""
    return json.loads(Path(file).with_name("measured.json").read_text(encoding="utf-8"))


def cheapest(points: Iterable[Any], batch: int, tolerance: float, refusal: str) -> Any:
    """The cheapest point whose promised error is within the tolerance, of those measured in the
    batch whose size is nearest by ratio.

    points: with batch, cost and promised_error. refusal: the message so far of the ValueError where
    there is none; {batch} in it is the nearest.
    """
    points = list(points)
    nearest = min({p.batch for p in points}, key=lambda b: abs(math.log(b / batch)), default=batch)
    points = [point for point in points if point.batch == nearest]
    good = [point for point in points if point.promised_error <= tolerance]
    if good:
        return min(good, key=lambda point: (point.cost, point.promised_error))
    best = min((point.promised_error for point in points), default=math.nan)
    accepted = f"from {best:.2g}" if points else "other ground, precision or checks"
    why = refusal.format(batch=nearest)
    raise ValueError(f"tolerance = {tolerance:g}: {why}; accepted: {accepted}")
