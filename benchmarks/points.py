"""Statistics of measured settings: confidence bounds of quantiles, fronts of cost and error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol, TypeVar

from stickslip.dynamics.fronts import front, knee


class Measured(Protocol):
    """A setting with a cost and an error."""

    @property
    def cost(self) -> float:
        """Seconds."""
        ...

    @property
    def error(self) -> float:
        """The worst of its errors, in one unit."""
        ...


P = TypeVar("P", bound=Measured)


def rank(count: int, quantile: float, confidence: float) -> int:
    """Rank of the sorted value that bounds the quantile from above with this confidence.

    The least k with P(Binomial(count, quantile) <= k - 1) >= confidence, whatever the
    distribution; count + 1 where there are too few values for a bound.
    """
    from scipy.stats import binom

    return int(binom.ppf(confidence, count, quantile)) + 1


def front_of(points: Sequence[P]) -> list[P]:
    """Points that no other beats in cost and error, the cheapest first."""
    return [points[i] for i in front([p.cost for p in points], [p.error for p in points])]


def knee_of(points: Sequence[P]) -> P:
    """The front's knee."""
    return points[knee([p.cost for p in points], [p.error for p in points])]


def unbeaten(
    points: Sequence[P], errors: Callable[[P], tuple[float, ...]], kind: Callable[[P], Any]
) -> list[P]:
    """Points that no other of their kind beats in cost and in each of the errors, in their order.

    Equal points do not beat each other.
    """
    rated = [(kind(p), (p.cost, *errors(p))) for p in points]

    def beaten(own: Any, values: tuple[float, ...]) -> bool:
        return any(
            other == own
            and better != values
            and all(a <= b for a, b in zip(better, values, strict=True))
            for other, better in rated
        )

    return [p for p, rating in zip(points, rated, strict=True) if not beaten(*rating)]
