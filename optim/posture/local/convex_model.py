"""The convex model of a posture problem about a point, as a cvxpy problem that is built once.

minimise outer(c + J step) / scale + penalty * (what the linear margins are missed by), over steps
within a box, the bounds and the leg rates. c, J, margins and box are parameters, multiplied block
by block, so that solving again only fills in numbers (disciplined parametrised programming).
"""

from __future__ import annotations

from typing import Any

import cvxpy as cp
import numpy as np

from stickslip.optim.cvx import solve_quietly
from stickslip.optim.posture.local.linearise import Linear, Near

PRICE = 100.0
"""Default penalty of a violated margin of one weight, in parts of the objective's scale."""


class _Block:
    """The linear model of [rows, m] terms in the leg angles of one or of two waypoints each."""

    def __init__(self, shape: tuple[int, ...], step: cp.Variable, both: bool):
        columns = [step[:, 0], step[:, 1]]
        if both:
            columns = [step[:-1, 0], step[:-1, 1], step[1:, 0], step[1:, 1]]
        rows, m = shape
        self.values = [cp.Parameter(rows) for _ in range(m)]
        self.slopes = [[cp.Parameter(rows) for _ in columns] for _ in range(m)]
        self.expression = cp.hstack(
            [
                value + sum(cp.multiply(a, x) for a, x in zip(slopes, columns, strict=True))
                for value, slopes in zip(self.values, self.slopes, strict=True)
            ]
        )

    def set(self, values: np.ndarray, slopes: np.ndarray) -> None:
        """Fill in values [rows, m] and slopes [rows, m, columns]."""
        for i, value in enumerate(self.values):
            value.value = values[:, i]
            for j, slope in enumerate(self.slopes[i]):
                slope.value = slopes[:, i, j]


class ConvexModel:
    """The model for a problem; scale: the objective's size at the first point."""

    def __init__(self, near: Near, x: np.ndarray, solver: str):
        problem, at = near.problem, near(x)
        K = len(problem.x)
        self.scale, self.solver = near.scale(at), solver
        self.bounds = [side.reshape(K, 2) for side in problem.bounds]
        self.step = cp.Variable((K, 2))
        self.low, self.high, self.angles = (cp.Parameter((K, 2)) for _ in range(3))
        self.penalty = cp.Parameter(nonneg=True)
        self.terms: list[_Block] = []
        self.factors: list[float] = []
        goal: Any = 0
        for one, weight, terms in zip(near.criteria, near.weights, at.terms, strict=True):
            block = _Block(terms.shape, self.step, both=one.kind == "sum")
            square = one.outer == "square"
            self.terms.append(block)
            self.factors.append(np.sqrt(self.scale) if square else self.scale)
            if one.kind == "max":
                goal += weight * cp.max(block.expression)
            else:
                each = cp.square if square else cp.pos
                goal += weight * cp.sum(each(block.expression))
        self.margins = {
            name: _Block(of.shape, self.step, both=False) for name, of in at.margins.items()
        }
        constraints: list[cp.Constraint] = [self.step >= self.low, self.step <= self.high]
        missed: Any = 0
        for block in self.margins.values():
            slack = cp.Variable(block.expression.shape, nonneg=True)
            constraints.append(block.expression + slack >= 0)
            missed += cp.sum(slack)
        if problem.leg_rate is not None:
            most = (problem.leg_rate * np.diff(problem.x))[:, None] * np.ones(2)
            moves = cp.diff(self.angles + self.step, axis=0)
            constraints += [moves <= most, moves >= -most]
        self.problem = cp.Problem(cp.Minimize(goal + self.penalty * missed), constraints)

    def promised(self, near: Near, x: np.ndarray, radius: float) -> float:
        """The relative decrease of the objective that the model promises within a box about a
        point, misses priced at PRICE: zero where it is stationary; infinite for a failed solver."""
        at = near(x)
        found = self.solve(x, at, radius, PRICE)
        if found is None:
            return np.inf
        short = sum(float(np.sum(np.maximum(-of, 0))) for of in at.margins.values())
        value = near.value(at) / self.scale + PRICE * short
        return max(value - found[1], 0.0) / max(abs(value), 1e-300)

    def solve(
        self, x: np.ndarray, at: Linear, radius: float, penalty: float
    ) -> tuple[np.ndarray, float] | None:
        """The best step [2K] within the box of that radius [rad], and the merit that the model
        promises there; None where the solver gave up."""
        angles = x.reshape(-1, 2)
        self.angles.value, self.penalty.value = angles, penalty
        low, high = self.bounds
        self.low.value = np.maximum(low - angles, -radius)
        self.high.value = np.minimum(high - angles, radius)
        each = zip(self.terms, at.terms, at.term_slopes, self.factors, strict=True)
        for block, terms, slopes, factor in each:
            block.set(terms / factor, slopes / factor)
        for name, block in self.margins.items():
            block.set(at.margins[name], at.margin_slopes[name])
        if not solve_quietly(self.problem, self.solver).answered:
            return None
        return np.asarray(self.step.value).reshape(-1), float(np.asarray(self.problem.value))
