"""How good a found point is: its gap to the best known, or what a front misses of hypervolume."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.instances.instance import Instance

LEAST = 1e-12
REFERENCE = 1.1
"""Where hypervolume is measured from; 0 to 1 are each goal's best and worst on the known front."""


class Target(NamedTuple):
    """The best known value, and the size that gaps are given in parts of."""

    best: float
    scale: float

    @classmethod
    def of(cls, instance: Instance) -> Target:
        """An instance's; with several goals 0 and 1, see Merit."""
        if len(instance.goals) > 1:
            return cls(0.0, 1.0)
        return cls(instance.best_known, max(abs(instance.best_known), LEAST))

    def gap(self, value: float | np.ndarray) -> np.ndarray:
        """(value - best) / scale: 0 for the best known, below for what is better."""
        return (np.asarray(value, float) - self.best) / self.scale


class Merit:
    """What an instance's points are recorded by: one number, the less the better.

    With one goal its value; of a noisy instance the mean over draws that no seed begins with. With
    two goals the share of the known front's hypervolume that a set of points misses.
    """

    def __init__(self, instance: Instance):
        self.instance, self.target = instance, Target.of(instance)
        self.several, self.noisy = len(instance.goals) > 1, instance.flags.noisy

    def of_point(self, x: Float[np.ndarray, "n"], value: float) -> float:
        """Of a point with this value, when it is one goal."""
        return float(self.instance.value(x)[0][0]) if self.noisy else value

    def of_front(self, values: Float[np.ndarray, "B 2"]) -> float:
        """Of a set of points."""
        low, high = self._corners
        found = hypervolume((values - low) / (high - low), REFERENCE)
        return 1.0 - found / self._whole

    @cached_property
    def _corners(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest values of the known front."""
        known = self.instance.known
        if known is None or known.front is None or known.front.shape[1] != 2:
            raise ValueError(f"{self.instance.id}: no front of two goals is known")
        return known.front.min(axis=0), known.front.max(axis=0)

    @cached_property
    def _whole(self) -> float:
        low, high = self._corners
        known = self.instance.known
        front = np.zeros((0, 2)) if known is None or known.front is None else known.front
        return hypervolume((front - low) / (high - low), REFERENCE)


def hypervolume(values: Float[np.ndarray, "B 2"], reference: float) -> float:
    """The area that points of two goals, both minimised, dominate up to (reference, reference)."""
    inside = values[np.all(values < reference, axis=1)]
    area, least = 0.0, reference
    for first, second in inside[np.lexsort((inside[:, 1], inside[:, 0]))]:
        if second < least:
            area += (reference - first) * (least - second)
            least = second
    return float(area)
