"""A posture problem as smooth plain arrays: z = (angles [2K], tops), everything scaled to about 1.

minimise the sum of weight * tops and squares, subject to terms <= tops, margins >= 0, leg rates.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import block_diag, coo_array, csr_array, hstack, vstack

from stickslip.optim.posture.local.linearise import Linear, Near

if TYPE_CHECKING:
    from jaxtyping import Float


class Epigraph:
    """Objective, constraints (>= 0) and their exact derivatives at z.

    best, best_value: the point of least objective among those seen that meet all constraints to
    rounding; None for none.
    """

    def __init__(self, near: Near, x: Float[np.ndarray, "n"]):
        self.near, self.n = near, len(x)
        at = near(x)
        self.scale = near.scale(at)
        self.best: np.ndarray | None = None
        self.best_value = np.inf
        self._tops: list[int] = []
        for one, terms in zip(near.criteria, at.terms, strict=True):
            count = 1 if one.kind == "max" else terms.size
            self._tops.append(0 if one.outer == "square" else count)
        self._rates = self._rate_rows()
        low, high = near.problem.bounds
        floor = [
            np.full(count, 0.0 if one.kind == "sum" else -np.inf)
            for one, count in zip(near.criteria, self._tops, strict=True)
        ]
        tops = sum(self._tops)
        self.bounds = (np.concatenate([low, *floor]), np.concatenate([high, np.full(tops, np.inf)]))

    def angles(self, z: np.ndarray) -> np.ndarray:
        """The decision vector within its bounds [2K]."""
        return np.clip(z[: self.n], *self.near.problem.bounds)

    def start(self, x: np.ndarray) -> np.ndarray:
        """x with the least tops that lie above the terms there."""
        tops = []
        for one, terms in zip(self.near.criteria, self.near(x).terms, strict=True):
            if one.kind == "max":
                tops.append([np.max(terms) / self.scale])
            elif one.outer != "square":
                tops.append(np.maximum(terms.ravel(), 0) / self.scale)
        return np.concatenate([x, *tops])

    def objective(self, z: np.ndarray) -> float:
        """The scaled objective."""
        at, total = self._at(z), 0.0
        for one, weight, terms, tops in self._each(at.terms, z):
            square = one.outer == "square"
            total += weight * float(np.sum(terms**2) / self.scale if square else np.sum(tops))
        return total

    def gradient(self, z: np.ndarray) -> np.ndarray:
        """Its slope [n + tops]."""
        at, slope, tops = self._at(z), np.zeros(self.n), []
        for i, (one, weight, terms, own) in enumerate(self._each(at.terms, z)):
            tops.append(np.full(len(own), weight))
            if one.outer == "square":
                rows = self._rows(at.term_slopes[i])
                slope += 2 * weight / self.scale * (rows.T @ terms.ravel())
        return np.concatenate([slope, *tops])

    def hessian(self, z: np.ndarray) -> csr_array:
        """The objective's second derivatives without those of its terms (Gauss-Newton)."""
        at, count = self._at(z), len(z)
        total = csr_array((self.n, self.n))
        for i, (one, weight, _, _) in enumerate(self._each(at.terms, z)):
            if one.outer == "square":
                rows = self._rows(at.term_slopes[i])
                total = total + 2 * weight / self.scale * (rows.T @ rows)
        tops = csr_array((count - self.n, count - self.n))
        return csr_array(block_diag([total, tops])) if len(tops.indptr) > 1 else total

    def constraints(self, z: np.ndarray) -> np.ndarray:
        """Tops less terms, margins, and what the leg rates leave; satisfied where >= 0."""
        at = self._at(z)
        found = [
            tops - terms.ravel() / self.scale
            for _, _, terms, tops in self._each(at.terms, z)
            if len(tops)
        ]
        found += [of.ravel() for of in at.margins.values()]
        matrix, most = self._rates
        found.append(most - matrix @ z[: self.n])
        return np.concatenate(found)

    def jacobian(self, z: np.ndarray) -> csr_array:
        """Slopes of the constraints, sparse."""
        at = self._at(z)
        rows: list[Any] = []
        tops: list[Any] = []
        for i, (one, _, terms, own) in enumerate(self._each(at.terms, z)):
            if one.outer == "square":
                tops.append(csr_array((0, 0)))
                continue
            rows.append(-self._rows(at.term_slopes[i]) / self.scale)
            tops.append(np.ones((terms.size, 1)) if one.kind == "max" else _eye(len(own)))
        rows += [self._rows(of) for of in at.margin_slopes.values()]
        rows.append(-self._rates[0])
        left: Any = vstack(rows)
        right: Any = csr_array(block_diag(tops)) if sum(self._tops) else csr_array((0, 0))
        below = csr_array((left.shape[0] - right.shape[0], right.shape[1]))
        return csr_array(hstack([left, vstack([right, below])]))

    def _at(self, z: np.ndarray) -> Linear:
        """The linear model at z's angles, noting the point if it is the best so far."""
        x = self.angles(z)
        fresh = self.near.evaluations
        at = self.near(x)
        if self.near.evaluations > fresh:
            value = self.near.value(at)
            if value < self.best_value and self.near.problem.is_feasible(x, 1e-9):
                self.best, self.best_value = x, value
        return at

    def _each(self, terms: list[np.ndarray], z: np.ndarray):
        """Criterion, weight, terms and tops of each part."""
        ends = self.n + np.cumsum([0, *self._tops])
        own = [z[a:b] for a, b in pairwise(ends)]
        return zip(self.near.criteria, self.near.weights, terms, own, strict=True)

    def _rows(self, slopes: np.ndarray) -> csr_array:
        """Blocks [rows, m, d] as a sparse matrix [rows m, n]: row k reads z from 2 k on."""
        rows, m, d = slopes.shape
        i = np.arange(rows * m).reshape(rows, m, 1)
        j = 2 * np.arange(rows)[:, None, None] + np.arange(d)
        at = np.broadcast_arrays(i, j, slopes)
        return csr_array(coo_array((slopes.ravel(), (at[0].ravel(), at[1].ravel())),
                                   shape=(rows * m, self.n)))  # fmt: skip

    def _rate_rows(self) -> tuple[Any, np.ndarray]:
        """A and b of A x <= b: the leg rates as shares of what they allow."""
        problem = self.near.problem
        if problem.leg_rate is None:
            return csr_array((0, self.n)), np.zeros(0)
        per = 1 / (problem.leg_rate * np.diff(problem.x))[:, None, None]
        moves = np.array([[-1, 0, 1, 0], [0, -1, 0, 1]]) * per
        rows: Any = self._rows(np.concatenate([moves, -moves], 1))
        return rows, np.ones(rows.shape[0])


def _eye(count: int) -> csr_array:
    at = np.arange(count)
    return csr_array((np.ones(count), (at, at)), shape=(count, count))
