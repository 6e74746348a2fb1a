"""The cone program of a gait in cvxpy, built once for each structure, with numbers as parameters.

    minimise  weights . (time, torque, work, torque over phase)   or the least relaxation r
    subject to  b[k+1] = b[k] + h (a[k] + a[k+1]),   A a + B b <= C + R r,   time <= longest

b = crank rate^2 and a = crank acceleration at the nodes of n steps: a is straight between nodes, so
b is a parabola in each cell and has a slope everywhere. A cell takes the time 2 h / (rate + next
rate), exact for constant acceleration, from rest, too: with s <= sqrt(b) that is a second-order
cone. All numbers are in the units of `Numbers`. Parameters enter linearly (DPP).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from threading import Lock
from typing import TYPE_CHECKING, NamedTuple

import cvxpy as cp
import numpy as np
import scipy.sparse as sp

from stickslip.optim.gait.gait import STRAIN, TIME, TORQUE, WORK
from stickslip.optim.result import Ended, OptimStatus, solve_quietly

if TYPE_CHECKING:
    from jaxtyping import Float

ACCURACY = {"tol_feas": 1e-11, "tol_gap_abs": 1e-11, "tol_gap_rel": 1e-11}
"""Tolerances of Clarabel. Small cells near rest need them; where it stops earlier, the certificate
says how good the gait is all the same."""


class Structure(NamedTuple):
    """Key of a program: sizes, terms of the objective, limits present."""

    steps: int
    cells: int
    rows: int
    periodic: bool
    terms: tuple[str, ...]
    """Empty where the relaxation is minimised."""
    timed: bool
    first: str = "free"
    """The end where the walk begins: "free", "given", or at "rest"."""
    last: str = "free"


@dataclass(frozen=True)
class Numbers:
    """A program's structure and its scaled numbers: h [n, K]; rows A, B, C and their relaxation R
    [m, nodes]; torque = torque[0] a + torque[1] b + torque[2] [nodes]; trapezoid weights [nodes]; a
    weight for each term; the longest time; least and greatest first and last b."""

    kind: Structure
    h: Float[np.ndarray, "n K"]
    A: Float[np.ndarray, "m nodes"]
    B: Float[np.ndarray, "m nodes"]
    C: Float[np.ndarray, "m nodes"]
    R: Float[np.ndarray, "m nodes"]
    torque: tuple[np.ndarray, np.ndarray, np.ndarray]
    trapezoid: Float[np.ndarray, "nodes"]
    weights: dict[str, float]
    longest: float | None
    first: tuple[float, float]
    last: tuple[float, float]


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
    """One structure's cvxpy problem; use `program_of`, which keeps them."""

    def __init__(self, kind: Structure):
        self.kind, self._lock = kind, Lock()
        n, K = kind.steps, kind.cells
        nodes = n * (K + 1)
        self._a, self._b = cp.Variable(nodes, name="a"), cp.Variable(nodes, name="b")
        self._r = cp.Variable()
        shape = (kind.rows, nodes)
        self._A, self._B, self._C, self._R = (cp.Parameter(shape) for _ in range(4))
        self._h = cp.Parameter(n * K, nonneg=True)
        self._torque = tuple(cp.Parameter(nodes) for _ in range(3))
        self._weights = {term: cp.Parameter(nodes, nonneg=True) for term in (WORK, STRAIN)}
        self._cell_weights = {term: cp.Parameter(n * K, nonneg=True) for term in (TIME, TORQUE)}
        self._longest = cp.Parameter(nonneg=True)
        self._ends = cp.Parameter(2, nonneg=True)
        left, right = _cell_ends(n, K)
        steps = cp.multiply(self._h, (left + right) @ self._a)
        self._motion = (right - left) @ self._b - steps == 0
        self._rows = self._limited()
        self._constraints: list[cp.Constraint] = [self._motion, *self._rows]
        self._exchange = self._exchanges(n, K)
        for i, end in ((0, kind.first), (-1, kind.last)):
            if end != "free":
                self._constraints.append(self._b[i] == self._ends[i])
        goal = self._goal(left + right)
        self.problem = cp.Problem(cp.Minimize(goal), self._constraints)

    def _limited(self) -> list[cp.Constraint]:
        found = []
        for i in range(self.kind.rows):
            taken = cp.multiply(self._A[i], self._a) + cp.multiply(self._B[i], self._b)
            most = self._C[i] if self.kind.terms else self._C[i] + self._R[i] * self._r
            found.append(taken <= most)
        return found

    def _exchanges(self, n: int, K: int) -> cp.Constraint | None:
        """b goes on over the exchange of support, or round the periodic step."""
        ends = [(K + 1) * j + K for j in range(n)]
        starts = [(K + 1) * j for j in range(n)]
        pairs = list(zip(ends[:-1], starts[1:], strict=True))
        pairs += [(ends[-1], starts[0])] if self.kind.periodic else []
        if not pairs:
            return None
        went, goes = (np.array(side) for side in zip(*pairs, strict=True))
        found = self._b[goes] - self._b[went] == 0
        self._constraints.append(found)
        return found

    def _goal(self, sums: sp.csr_array) -> cp.Expression:
        terms = self.kind.terms
        parts: list[cp.Expression] = []
        on_a, on_b, rest = self._torque
        torque = cp.multiply(on_a, self._a) + cp.multiply(on_b, self._b) + rest
        self._timing = None
        if self.kind.timed or TIME in terms or TORQUE in terms:
            moving, count = _moving(self.kind), self.kind.steps * self.kind.cells
            still = [self.kind.first, self.kind.last].count("rest")
            root = cp.Variable(count + self.kind.steps - still)
            pair = (sums @ moving.T) @ root  # rate + next rate
            self._constraints.append(cp.square(root) <= moving @ self._b)
            if self.kind.timed or TIME in terms:
                slow = cp.Variable(count)  # >= 1 / pair
                rows = cp.vstack([np.full(count, 2.0), slow - pair])
                self._constraints.append(cp.SOC(slow + pair, rows, axis=0))
                if self.kind.timed:
                    self._timing = 2 * (self._h @ slow) <= self._longest
                    self._constraints.append(self._timing)
                if TIME in terms:
                    parts.append(self._cell_weights[TIME] @ slow)
            if TORQUE in terms:
                heat = cp.Variable(count)  # >= (torque^2 + next torque^2) / pair
                left, right = _cell_ends(self.kind.steps, self.kind.cells)
                rows = cp.vstack([2 * (left @ torque), 2 * (right @ torque), heat - pair])
                self._constraints.append(cp.SOC(heat + pair, rows, axis=0))
                parts.append(self._cell_weights[TORQUE] @ heat)
        if WORK in terms:
            positive = cp.Variable(torque.size, nonneg=True)
            self._constraints.append(positive >= torque)
            parts.append(self._weights[WORK] @ positive)
        if STRAIN in terms:
            square = cp.Variable(torque.size)
            self._constraints.append(cp.square(torque) <= square)
            parts.append(self._weights[STRAIN] @ square)
        if terms:
            return sum(parts[1:], parts[0])
        self._constraints.append(self._r >= -1)
        return self._r

    def solve(self, numbers: Numbers) -> Solved | Ended:
        """The solution with these numbers, or how the solver ended without a point."""
        with self._lock:
            self._set(numbers)
            ended = solve_quietly(self.problem, bounded=True, **ACCURACY)
            if not ended.answered or self._b.value is None:
                return ended
            return self._solved(*ended)

    def filled(self, numbers: Numbers) -> cp.Problem:
        """The problem with these numbers, for any solver; `read` gives the solution."""
        self._set(numbers)
        return self.problem

    def read(self) -> tuple[np.ndarray, np.ndarray]:
        """a and b at the nodes of a problem that was solved [n, K+1]."""
        shape = self.kind.steps, self.kind.cells + 1
        a, b = (np.asarray(one.value).reshape(shape) for one in (self._a, self._b))
        return a, b

    def _set(self, given: Numbers) -> None:
        for name in "ABCR":
            getattr(self, f"_{name}").value = getattr(given, name)
        for parameter, value in zip(self._torque, given.torque, strict=True):
            parameter.value = value
        self._h.value = h = given.h.ravel()
        for term, parameter in self._weights.items():
            parameter.value = given.weights.get(term, 0.0) * given.trapezoid
        for term, factor in ((TIME, 2.0), (TORQUE, 1.0)):
            self._cell_weights[term].value = factor * given.weights.get(term, 0.0) * h
        self._longest.value = 0.0 if given.longest is None else given.longest
        self._ends.value = np.array([given.first[0], given.last[0]])

    def _solved(self, status: OptimStatus, message: str) -> Solved:
        a, b = self.read()

        def dual(constraint: cp.Constraint | None) -> np.ndarray:
            value = np.zeros(0) if constraint is None else np.asarray(constraint.dual_value)
            return np.nan_to_num(value, posinf=0.0, neginf=0.0)

        time = 0.0 if self._timing is None else max(float(dual(self._timing)), 0.0)
        duals = Duals(
            motion=dual(self._motion).reshape(a.shape[0], -1),
            exchange=np.ravel(dual(self._exchange)),
            time=time,
            rows=np.stack([dual(row) for row in self._rows]),
        )
        relaxation = 0.0 if self.kind.terms else float(np.asarray(self._r.value))
        return Solved(status, message, a, b, duals, relaxation)


@lru_cache(maxsize=24)
def program_of(kind: Structure) -> Program:
    """The program of a structure, built when it is first asked for."""
    return Program(kind)


def _moving(kind: Structure) -> sp.csr_array:
    """The matrix that picks the nodes at which the crank may move: at rest a cone has no inside."""
    nodes = np.arange(kind.steps * (kind.cells + 1))
    kept = nodes[int(kind.first == "rest") : len(nodes) - int(kind.last == "rest")]
    return sp.csr_array(
        (np.ones(len(kept)), (np.arange(len(kept)), kept)), shape=(len(kept), len(nodes))
    )


def _cell_ends(n: int, K: int) -> tuple[sp.csr_array, sp.csr_array]:
    """Matrices [n K, n (K + 1)] that pick the left and the right node of each cell."""
    first = (np.arange(n)[:, None] * (K + 1) + np.arange(K)).ravel()
    ones, rows, shape = np.ones(n * K), np.arange(n * K), (n * K, n * (K + 1))
    left, right = (sp.csr_array((ones, (rows, first + i)), shape=shape) for i in (0, 1))
    return left, right
