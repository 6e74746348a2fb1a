"""Problems that know nothing of vehicles, with answers on paper."""

from __future__ import annotations

import numpy as np

from stickslip.optim import Evaluation, Problem, Result, Structure


class Nearest(Problem[Result]):
    """The point of a disc and a box nearest to a target: a convex problem in the plane.

    With `given`, the first number is that.
    """

    def __init__(self, target, radius: float, given: float | None = None):
        self.target, self.radius, self.given = np.asarray(target, float), radius, given
        self.looked_at = 0

    @property
    def structure(self):
        return frozenset({Structure.SMOOTH, Structure.CONVEX})

    @property
    def n(self):
        return 2

    @property
    def bounds(self):
        low, high = np.array([-2.0, -2.0]), np.array([2.0, 2.0])
        if self.given is not None:
            low[0] = high[0] = self.given
        return low, high

    def evaluate(self, x):
        self.looked_at += 1
        x = self.batch(np.asarray(x)[None])[0]
        margins = np.array([1 - x @ x / self.radius**2])
        missed = max(np.sqrt(x @ x) - self.radius, 0.0)
        value = float(np.sum((x - self.target) ** 2))
        return Evaluation(value, margins, self.meets(x, margins), {"disc": missed})

    def gradient(self, x):
        return 2 * (np.asarray(x) - self.target)

    def jacobian(self, x):
        return -2 * np.asarray(x)[None] / self.radius**2


class Steps(Nearest):
    """The same, known by its values alone, and without any outside the right half."""

    @property
    def structure(self):
        return frozenset()

    def evaluate(self, x):
        found = super().evaluate(x)
        value = found.value if np.asarray(x)[0] >= 0 else np.inf
        return Evaluation(value, found.margins, found.feasible, found.residuals)
