"""Points of cost and error, whatever was measured: their front, its knee, what nothing beats."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol, TypeVar

from stickslip.dynamics.fronts import front, knee


class Measured(Protocol):
    """What has a cost and an error."""

    @property
    def cost(self) -> float:
        """Time that one of what is counted takes."""
        ...

    @property
    def error(self) -> float:
        """The worst of its errors, in one unit."""
        ...


P = TypeVar("P", bound=Measured)


def front_of(points: Sequence[P]) -> list[P]:
    """The points that no other beats in cost and error, the cheapest first."""
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
