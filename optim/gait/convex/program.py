"""The cone program of a gait in cvxpy.

    minimise  weights . (time, torque, work)   or the least relaxation r
    subject to  b[k+1] = b[k] + h (a[k] + a[k+1]),   A a + B b <= C + R r,   time <= longest

b = crank rate^2 and a = crank acceleration at the nodes of n steps: a is straight between nodes, so
b is a parabola in each cell and has a slope everywhere. A cell takes the time 2 h / (rate + next
rate), exact for constant acceleration, from rest, too: with s <= sqrt(b) that is a second-order
cone. All numbers are in the units of `Numbers`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import cvxpy as cp
import numpy as np
import scipy.sparse as sp

from stickslip.optim.gait.gait import TIME, TORQUE, WORK
from stickslip.optim.result import Ended, OptimStatus, solve_quietly

if TYPE_CHECKING:
    from jaxtyping import Float

ACCURACY = {"tol_feas": 1e-11, "tol_gap_abs": 1e-11, "tol_gap_rel": 1e-11}
"""Tolerances of Clarabel. Small cells near rest need them; where it stops earlier, the certificate
says how good the gait is all the same."""


@dataclass(frozen=True)
class Sample:
    """A program's scaled coefficients at crank angles [m]: rows A, B, C; torque = torque[0] a +
    torque[1] b + torque[2]; least and greatest b; `weight` of each angle in an integral over the
    phase."""

    A: Float[np.ndarray, "rows m"]
    B: Float[np.ndarray, "rows m"]
    C: Float[np.ndarray, "rows m"]
    torque: tuple[np.ndarray, np.ndarray, np.ndarray]
    ends: tuple[np.ndarray, np.ndarray]
    weight: Float[np.ndarray, "m"]


@dataclass(frozen=True)
class Numbers(Sample):
    """A program's scaled numbers, its sample at the nodes. h [n, K]; relaxed: whether a row may be
    exceeded by r [rows]; a weight for each term, none where r is minimised; the longest time; least
    and greatest first and last b; whether the step ends as it begins."""

    h: Float[np.ndarray, "n K"]
    relaxed: np.ndarray
    weights: dict[str, float]
    longest: float | None
    first: tuple[float, float]
    last: tuple[float, float]
    periodic: bool


class Duals(NamedTuple):
    """Multipliers of the solver, 0 where it gives none that is finite: of each cell's dynamics
    [n, K], of b at each exchange [n - 1, or n where periodic], of the time >= 0, of the rows
    [m, nodes]."""

    motion: Float[np.ndarray, "n K"]
    exchange: Float[np.ndarray, "e"]
    time: float
    rows: Float[np.ndarray, "m nodes"]


class Solved(NamedTuple):
    """Solver status, a and b at the nodes [n, K+1], multipliers, and the relaxation."""

    status: OptimStatus
    message: str
    a: Float[np.ndarray, "n K+1"]
    b: Float[np.ndarray, "n K+1"]
    duals: Duals
    relaxation: float


class Program:
    """The cvxpy problem of some numbers."""

    def __init__(self, given: Numbers):
        self._given, (n, K) = given, given.h.shape
        nodes, h = n * (K + 1), given.h.ravel()
        self._a, self._b = cp.Variable(nodes, name="a"), cp.Variable(nodes, name="b")
        self._r = cp.Variable()
        self._left, self._right = _cell_ends(n, K)
        gained = cp.multiply(h, (self._left + self._right) @ self._a)
        self._motion = (self._right - self._left) @ self._b - gained == 0
        self._rows = [self._limited(i) for i in range(len(given.A))]
        self._constraints: list[cp.Constraint] = [self._motion, *self._rows]
        self._exchange = self._exchanges(n, K)
        for i, (low, high) in ((0, given.first), (-1, given.last)):
            if low == high:
                self._constraints.append(self._b[i] == low)
        self._timing: cp.Constraint | None = None
        self.problem = cp.Problem(cp.Minimize(self._goal(h)), self._constraints)

    def _limited(self, i: int) -> cp.Constraint:
        given = self._given
        taken = cp.multiply(given.A[i], self._a) + cp.multiply(given.B[i], self._b)
        return taken <= (given.C[i] + self._r if given.relaxed[i] else given.C[i])

    def _exchanges(self, n: int, K: int) -> cp.Constraint | None:
        """b goes on over the exchange of support, or round the periodic step."""
        starts = (K + 1) * np.arange(n)
        went, goes = (starts + K, np.roll(starts, -1))
        if not self._given.periodic:
            went, goes = went[:-1], goes[:-1]
        if not len(went):
            return None
        found = self._b[goes] - self._b[went] == 0
        self._constraints.append(found)
        return found

    def _goal(self, h: np.ndarray) -> cp.Expression:
        given, weights = self._given, self._given.weights
        on_a, on_b, rest = given.torque
        torque = cp.multiply(on_a, self._a) + cp.multiply(on_b, self._b) + rest
        parts: list[cp.Expression] = []
        if given.longest is not None or TIME in weights or TORQUE in weights:
            parts += self._paced(h, torque)
        if WORK in weights:
            positive = cp.Variable(torque.size, nonneg=True)
            self._constraints.append(positive >= torque)
            parts.append(weights[WORK] * given.weight @ positive)
        if weights:
            return sum(parts[1:], parts[0])
        self._constraints.append(self._r >= -1)
        return self._r

    def _paced(self, h: np.ndarray, torque: cp.Expression) -> list[cp.Expression]:
        """Terms of the objective that go with the time of each cell; its limit is a constraint."""
        given, weights = self._given, self._given.weights
        parts: list[cp.Expression] = []
        rests = [int(high == 0) for _, high in (given.first, given.last)]
        moving = slice(rests[0], self._b.size - rests[1])  # at rest a cone has no inside
        root = cp.Variable(self._b.size - sum(rests))
        pair = sp.csr_array(self._left + self._right)[:, moving] @ root  # rate + next rate
        self._constraints.append(cp.square(root) <= self._b[moving])
        if given.longest is not None or TIME in weights:
            slow = cp.Variable(h.size)  # >= 1 / pair
            rows = cp.vstack([np.full(h.size, 2.0), slow - pair])
            self._constraints.append(cp.SOC(slow + pair, rows, axis=0))
            if given.longest is not None:
                timing = 2 * (h @ slow) <= given.longest
                self._constraints.append(timing)
                self._timing = timing
            if TIME in weights:
                parts.append(2 * weights[TIME] * h @ slow)
        if TORQUE in weights:
            heat = cp.Variable(h.size)  # >= (torque^2 + next torque^2) / pair
            ends = 2 * (self._left @ torque), 2 * (self._right @ torque)
            rows = cp.vstack([*ends, heat - pair])
            self._constraints.append(cp.SOC(heat + pair, rows, axis=0))
            parts.append(weights[TORQUE] * h @ heat)
        return parts

    def solve(self) -> Solved | Ended:
        """The solution, or how the solver ended without a point."""
        ended = solve_quietly(self.problem, bounded=True, **ACCURACY)
        if not ended.answered or self._b.value is None:
            return ended
        a, b = self.read()
        duals = Duals(
            motion=_dual(self._motion).reshape(self._given.h.shape),
            exchange=np.ravel(_dual(self._exchange)),
            time=float(np.max(_dual(self._timing), initial=0.0)),
            rows=np.stack([_dual(row) for row in self._rows]),
        )
        relaxation = 0.0 if self._given.weights else float(np.asarray(self._r.value))
        return Solved(*ended, a, b, duals, relaxation)

    def read(self) -> tuple[np.ndarray, np.ndarray]:
        """a and b at the nodes of the solved problem [n, K+1]."""
        n = len(self._given.h)
        a, b = (np.asarray(one.value).reshape(n, -1) for one in (self._a, self._b))
        return a, b


def _dual(constraint: cp.Constraint | None) -> np.ndarray:
    value = np.zeros(0) if constraint is None else np.asarray(constraint.dual_value)
    return np.nan_to_num(value, posinf=0.0, neginf=0.0)


def _cell_ends(n: int, K: int) -> tuple[sp.csr_array, sp.csr_array]:
    """Matrices [n K, n (K + 1)] that pick the left and the right node of each cell."""
    first = (np.arange(n)[:, None] * (K + 1) + np.arange(K)).ravel()
    ones, rows, shape = np.ones(n * K), np.arange(n * K), (n * K, n * (K + 1))
    left, right = (sp.csr_array((ones, (rows, first + i)), shape=shape) for i in (0, 1))
    return left, right
