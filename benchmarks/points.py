"""Statistics of measured settings: confidence bounds of quantiles, fronts of cost and error."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import Any, TypeVar

P = TypeVar("P", bound=Any)
"""A setting with its `cost` [s] and `error`, the worst of its errors in one unit."""

USEFUL = 0.1
"""Largest error of a point of a front, in its own unit: beyond it, the answer is but a guess."""


def front_of(points: Sequence[P]) -> list[P]:
    """Points that no other beats in cost and error, the cheapest first; error <= USEFUL."""
    found: list[P] = []
    for point in sorted(points, key=lambda p: (p.cost, p.error)):
        if point.error < (found[-1].error if found else USEFUL * (1 + 1e-12)):
            found.append(point)
    return found


def knee_of(points: Sequence[P]) -> P:
    """The knee of the front: farthest below the chord of its ends, in log-log.

    Both axes are scaled to the front's extent first. Of a front of one or two points, its last.
    ValueError if no error is within USEFUL.
    """
    along = front_of(points)
    if not along:
        raise ValueError(f"no front: every error exceeds {USEFUL:g}; accepted: one within")
    if len(along) < 3:
        return along[-1]
    costs, errors = ([p.cost for p in along], [p.error for p in along])
    x, y = ([math.log(max(value, 1e-300)) for value in each] for each in (costs, errors))
    across, down = x[-1] - x[0], y[0] - y[-1]
    below = [1 - (a - x[0]) / across - (b - y[-1]) / down for a, b in zip(x, y, strict=True)]
    return along[max(range(len(along)), key=lambda i: below[i])]


def upper_bound(values: Iterable[float], quantile: float, confidence: float) -> float:
    """The value that bounds the quantile from above with this confidence; infinite for too few.

    The k-th of the sorted values, whatever their distribution: the least k for which
    P(Binomial(count, quantile) <= k - 1) >= confidence.
    """
    from scipy.stats import binom

    ordered = [*sorted(values), math.inf]
    return float(ordered[int(binom.ppf(confidence, len(ordered) - 1, quantile))])


def unbeaten(rated: Mapping[int, tuple[Hashable, tuple[float, ...]]]) -> set[int]:
    """Keys of points that no other of their kind beats in every number.

    rated: kind and numbers of each point. Equal points do not beat each other.
    """

    def beaten(own: Hashable, values: tuple[float, ...]) -> bool:
        return any(
            other == own
            and better != values
            and all(a <= b for a, b in zip(better, values, strict=True))
            for other, better in rated.values()
        )

    return {key for key, rating in rated.items() if not beaten(*rating)}
