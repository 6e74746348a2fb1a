"""Enclosures of the arc length along the ground, for a wheel that rolls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics.checks import require_memory
from stickslip.optim.intervals.arithmetic import Interval, interval

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.posture.bounds.ground import Ground

CELL = 2e-3
"""Length of a cell of the quadrature, at most [m]; its error falls with the fourth power."""
BYTES_A_CELL = 2_000


@dataclass(frozen=True)
class Arc:
    """The integral of q = sqrt(1 + f'^2) from the first edge to each: [cells + 1]."""

    ground: Ground
    edges: Float[np.ndarray, "cells+1"]
    sums: Interval
    bends: Interval
    """q'' over each cell; where the ground is not smooth inside, all that q may do."""

    @classmethod
    def along(cls, ground: Ground, start: float, end: float) -> Arc:
        """Arc length by the midpoint rule with remainder, h q(middle) + h^3 / 24 q''(somewhere)."""
        knots = np.concatenate([ground.knots, ground.kinks, ground.bends])
        knots = np.unique(knots[(knots > start) & (knots < end)])
        count = (end - start) / CELL + len(knots)
        require_memory(f"a drive of {end - start:.6g} m", "cells", count, BYTES_A_CELL)
        even = np.linspace(start, end, int(np.ceil((end - start) / CELL)) + 1)
        edges = np.unique(np.concatenate([even, knots]))
        left, right = edges[:-1], edges[1:]
        _, m, f2, f3 = ground.profile(
            Interval(np.nextafter(left, right), np.nextafter(right, left))
        )
        square = m.square() + 1.0
        bends = (f2.square() / square + m * f3) / square.sqrt()
        pieces = _integral(ground, interval(left), interval(right), bends)
        lo = np.concatenate([[0.0], np.cumsum(pieces.lo)])
        hi = np.concatenate([[0.0], np.cumsum(pieces.hi)])
        slack = len(edges) * np.finfo(float).eps * (1 + np.abs(hi))
        sums = Interval(lo - slack, hi + slack)
        return cls(ground, edges, sums, bends)

    def at(self, x: Interval) -> Interval:
        """S(x) for narrow x that lie between the ends."""
        cell = np.clip(np.searchsorted(self.edges, x.middle, "right") - 1, 0, len(self.edges) - 2)
        begin = interval(self.edges[cell])
        bends = self.bends[cell]
        rest = _integral(self.ground, begin, interval(x.middle), bends)
        # The rest of x, over which q is at least 1 and at most what the slope there says.
        steep = (self.ground.profile(x)[1].square() + 1.0).sqrt()
        off = (x - x.middle) * Interval(np.ones(x.shape), steep.hi)
        return self.sums[cell] + rest + off


def _integral(ground: Ground, a: Interval, b: Interval, bend: Interval) -> Interval:
    """Integral of q from a to b, thin numbers within a cell; bend: q'' there."""
    h = b - a
    middle = a + h * 0.5
    q = (ground.profile(middle)[1].square() + 1.0).sqrt()
    return h * q + h * h.square() * bend / 24.0
