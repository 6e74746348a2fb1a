"""Pareto fronts of cost and error, and their knees."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

USEFUL = 0.1
"""Largest error of a point of a front, in its own unit: beyond it, the answer is but a guess."""


def front(costs: Sequence[float], errors: Sequence[float]) -> list[int]:
    """Indices of the points that no other beats in both, the cheapest first; error <= USEFUL."""
    found: list[int] = []
    for index in sorted(range(len(costs)), key=lambda i: (costs[i], errors[i])):
        best = errors[found[-1]] if found else USEFUL * (1 + 1e-12)
        if errors[index] < best:
            found.append(index)
    return found


def knee(costs: Sequence[float], errors: Sequence[float]) -> int:
    """Index of the knee of a front: farthest below the chord of its ends, in log-log.

    Both axes are scaled to the front's extent first. Of a front of one or two points, its last.
    ValueError if no error is within USEFUL.
    """
    along = front(costs, errors)
    if not along:
        raise ValueError(f"no front: every error exceeds {USEFUL:g}; accepted: one within")
    if len(along) < 3:
        return along[-1]
    x, y = ([math.log(max(values[i], 1e-300)) for i in along] for values in (costs, errors))
    across, down = x[-1] - x[0], y[0] - y[-1]
    below = [1 - (a - x[0]) / across - (b - y[-1]) / down for a, b in zip(x, y, strict=True)]
    return along[max(range(len(along)), key=lambda i: below[i])]
