"""A convex program in one free number, parametrised once and solved for each posture.

    minimise outer(alpha + beta d)   subject to   a + b d <= 0

With a motor at each wheel the ground forces of a fixed posture are affine in one number d, and so
is all that is asked of them. The cvxpy problem is built once with alpha, beta, a, b as parameters
(disciplined parametrised programming); its duals prove a bound, worked out here without trusting
the solver.
"""

from __future__ import annotations

from typing import NamedTuple

import cvxpy as cp
import numpy as np

from stickslip.optim.cvx import solve_quietly
from stickslip.optim.result import OptimStatus

ROUNDINGS = 5e-13
"""Allowance of a bound, relative to the numbers that it sums: stations computed by other
means differ by less (posture/rounding.py), and its own sums by far less."""

ENDLESS = (
    "no split is the best: the harder the wheels pull against each other, the less the value; "
    "accepted: a max_torque"
)


class Affine(NamedTuple):
    """Numbers alpha + beta d, [m] each."""

    alpha: np.ndarray
    beta: np.ndarray

    def at(self, d: float) -> np.ndarray:
        """Their values at d, [m]."""
        return self.alpha + self.beta * d


class SplitSolution(NamedTuple):
    """d, the objective there, what is proved of it, and how the solver ended."""

    d: float
    value: float
    bound: float
    status: OptimStatus


class SplitProgram:
    """The program for a given outer function and numbers of terms and of limits.

    outer: "max", the largest term; "positive", the sum of positive parts; "square", of squares.
    """

    def __init__(self, outer: str, terms: int, limits: int):
        self.outer = outer
        alpha, beta, a, b = (cp.Parameter(size) for size in (terms, terms, limits, limits))
        self._parameters = alpha, beta, a, b
        self._d = cp.Variable()
        terms_at = alpha + beta * self._d
        self._limited = a + b * self._d <= 0
        constraints: list[cp.Constraint] = [self._limited]
        if outer == "square":
            goal = cp.sum_squares(terms_at)
        else:
            top = cp.Variable() if outer == "max" else cp.Variable(terms, nonneg=True)
            self._above = terms_at <= top
            constraints.append(self._above)
            goal = top if outer == "max" else cp.sum(top)
        self.problem = cp.Problem(cp.Minimize(goal), constraints)

    def solve(self, terms: Affine, limits: Affine) -> SplitSolution:
        """Solve for these numbers; d is put back inside the limits to rounding.

        Where a largest term falls without end: FAILED, d some split, the bound -inf.
        """
        if self.outer == "max" and endless(terms, limits):
            d = nearest_equal(*interval(limits))
            return SplitSolution(d, outer_value("max", terms.at(d)), -np.inf, OptimStatus.FAILED)
        size = float(np.max(np.abs(terms.alpha))) or 1.0
        terms = Affine(terms.alpha / size, terms.beta / size)
        scale = size**2 if self.outer == "square" else size
        for parameter, value in zip(self._parameters, (*terms, *limits), strict=True):
            parameter.value = value
        solver = cp.CLARABEL if self.outer == "square" else cp.HIGHS
        ended = solve_quietly(self.problem, solver, bounded=True)  # it has a floor
        if not ended.answered:
            return SplitSolution(np.nan, np.inf, -np.inf, ended.status)
        low, high = interval(limits)
        d = float(np.clip(np.asarray(self._d.value), low, high)) if low <= high else low
        value = outer_value(self.outer, terms.at(d))
        bound = self._bound(terms, limits, value)
        if self.outer != "max":
            bound = max(bound, 0.0)
        return SplitSolution(d, value * scale, bound * scale, ended.status)

    def _bound(self, terms: Affine, limits: Affine, value: float) -> float:
        """A lower bound on the objective by weak duality, from the duals the solver returned.

        Any weights w >= 0 of the limits, and y of the terms (on the simplex for max, from 0 to 1
        for positive parts), make y (alpha + beta d) + w (a + b d) no more than the objective
        wherever the limits hold. Its least value over all d that might be better than `value`,
        less what rounding may do, is a bound, whatever the solver did.
        """
        w = np.maximum(np.asarray(self._limited.dual_value, float), 0.0)
        low, high = interval(_no_worse(self.outer, terms, limits, value))
        if not (np.all(np.isfinite(w)) and low <= high):
            return value - ROUNDINGS * abs(value) if low > high else -np.inf
        constant, slope = float(w @ limits.alpha), float(w @ limits.beta)
        size = abs(value) + float(w @ np.abs(limits.alpha))
        if self.outer == "square":
            least = min(value, _least_quadratic(terms, constant, slope, low, high))
            return least - ROUNDINGS * (size + float(terms.alpha @ terms.alpha))
        y = np.clip(np.asarray(self._above.dual_value, float), 0.0, 1.0)
        if self.outer == "max":
            y = y / max(np.sum(y), np.finfo(float).tiny)
        constant, slope = constant + float(y @ terms.alpha), slope + float(y @ terms.beta)
        ends = [constant + slope * end if slope else constant for end in (low, high)]
        return float(min(value, *ends)) - ROUNDINGS * (size + float(y @ np.abs(terms.alpha)))


def outer_value(outer: str, terms: np.ndarray) -> float:
    """The objective of these terms [m]."""
    if outer == "max":
        return float(np.max(terms))
    return float(np.sum(np.maximum(terms, 0.0) if outer == "positive" else terms**2))


def interval(limits: Affine) -> tuple[float, float]:
    """The d that limits allow, from low to high; low > high where there are none."""
    below, above, _, _ = ends(limits)
    return below, above


def endless(terms: Affine, limits: Affine) -> bool:
    """True if all terms fall together as d goes on for ever within the limits."""
    low, high = interval(limits)
    onwards = high == np.inf and np.all(terms.beta < 0)
    return bool(low <= high and (onwards or (low == -np.inf and np.all(terms.beta > 0))))


def nearest_equal(low: float, high: float) -> float:
    """The d from low to high that is nearest to the same torque at each wheel."""
    return float(np.clip(0.0, low, high))


def ends(limits: Affine) -> tuple[float, float, int, int]:
    """Low and high end and the limit that sets each, -1 for none; (inf, -inf, i, i) where limit i
    alone cannot be met."""
    a, b = limits
    never = (b == 0) & (a > 0)
    if np.any(never):
        i = int(np.argmax(never))
        return np.inf, -np.inf, i, i
    at = np.divide(-a, b, out=np.zeros_like(a), where=b != 0)
    below, above = np.where(b < 0, at, -np.inf), np.where(b > 0, at, np.inf)
    i, j = int(np.argmax(below)), int(np.argmin(above))
    return (
        float(below[i]),
        float(above[j]),
        i if np.isfinite(below[i]) else -1,
        j if np.isfinite(above[j]) else -1,
    )


def _no_worse(outer: str, terms: Affine, limits: Affine, value: float) -> Affine:
    """The limits, and those on each term that an objective of `value` or less implies."""
    top = np.sqrt(value) if outer == "square" else value
    signs = (1.0, -1.0) if outer == "square" else (1.0,)
    alpha = [limits.alpha, *(s * terms.alpha - top for s in signs)]
    beta = [limits.beta, *(s * terms.beta for s in signs)]
    return Affine(np.concatenate(alpha), np.concatenate(beta))


def _least_quadratic(terms: Affine, constant: float, slope: float, low: float, high: float):
    """Least value over [low, high] of |alpha + beta d|^2 + constant + slope d."""
    half, curvature = terms.alpha @ terms.beta + slope / 2, terms.beta @ terms.beta
    if curvature == 0:
        flat = float(terms.alpha @ terms.alpha + constant)
        return flat + min(slope * low, slope * high) if slope else flat
    d = float(np.clip(-half / curvature, low, high))
    return float(np.sum(terms.at(d) ** 2) + constant + slope * d)
