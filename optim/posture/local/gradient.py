"""Nonlinear programming by scipy on exact derivatives of smooth terms and margins; evolution.

Positive parts and worst stations have kinks, so each gets a number of its own, a top, that lies
above the terms, and is minimised (epigraph form): all that scipy sees is smooth. z = (leg angles
[2K], tops), everything scaled to about 1:

minimise the sum of weight * tops and squares, subject to terms <= tops, margins >= 0, leg rates.
"""

from __future__ import annotations

import time
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.checks import require_integer, shown
from stickslip.optim.methods import (
    SLSQP_STATUSES,
    evolution,
    evolve,
    package,
    slsqp,
)
from stickslip.optim.options import COUNT, require_scalar
from stickslip.optim.posture.local.linearise import Linear, Near, begin, within_rates
from stickslip.optim.posture.local.scp import ConvexModel
from stickslip.optim.posture.result import PostureResult
from stickslip.optim.posture.waypoints import (
    CONVEX,
    COVARIANCE,
    DENSE,
    require_stations,
    require_waypoint_matrices,
)
from stickslip.optim.progress import Bar
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.posture.problem import PostureProblem

INWARD = 1e-3
"""Shift of a run's start towards the middle, in parts: SLSQP takes corners, where more
limits meet than there are directions, for solutions."""
BOX, STATIONARY, RUNS_MOST = 1e-3, 1e-5, 4
"""scipy's solution is accepted where the convex model promises a relative decrease below
STATIONARY within BOX [rad]; else it begins again from there, RUNS_MOST times in all."""


def solve_gradient(
    problem: PostureProblem,
    *,
    progress: bool = False,
    start: Any = "dp",
    angles: Any = None,
    iterations: int = 200,
    tolerance: float = 1e-8,
) -> PostureResult:
    """A local optimum off the grid, from `start`: see start_point, to which angles goes too.

    scipy's SLSQP, dense, good to some hundred numbers. tolerance: its ftol, of the scaled problem.
    What scipy calls a solution is checked by the convex model of `scp` (see BOX), and
    where that is not content scipy runs again. Of the points tried, the best that meets all
    constraints is returned if the last one does not; value and residuals are the problem's own.

    Nothing is proved of the value: FEASIBLE, LIMIT, VIOLATED, INACCURATE where scipy gave up or
    stopped short at a point that meets the constraints, FAILED without a pose to begin.
    evaluations: linearisations. details: scipy's own status and message, iterations, runs, and
    promised (the relative decrease that the convex model promises within BOX).
    """
    began = time.perf_counter()
    iterations = require_integer("iterations", iterations, high=COUNT)
    require_scalar("tolerance", tolerance, low=0.0, strict=True, accepted="a number > 0")
    require_waypoint_matrices(problem, "gradient", CONVEX, DENSE)
    begun = begin(problem, "gradient", start, angles, progress, began)
    if isinstance(begun, PostureResult):
        return begun
    near, x, note = begun
    with Bar("gradient", iterations, "iteration", progress) as bar:
        x, status, message, details = _last_run(near, x, iterations, tolerance, bar)
    return problem.result(
        x,
        method="gradient",
        began=began,
        status=status,
        evaluations=near.evaluations,
        message=f"{note}{message}{problem.shortcomings(x)}",
        details=details,
    )


def _last_run(
    near: Near, x: np.ndarray, iterations: int, tolerance: float, bar: Bar
) -> tuple[np.ndarray, OptimStatus, str, dict[str, Any]]:
    """Point, status, message and details of scipy's last run, the convex model confirming its
    solution or RUNS_MOST being over."""
    form, model = Epigraph(near, x), ConvexModel(near, x)
    inside = within_rates(near.problem, np.mean(near.problem.bounds, axis=0))
    inside = x if inside is None else inside
    steps = runs = 0
    while True:
        begun = form.start(x + INWARD * (inside - x))
        found = slsqp(form, begun, iterations - steps, tolerance, bar)
        steps, runs = steps + found.nit, runs + 1
        x, where = _chosen(form, found.x)
        promised = model.promised(near, x, BOX)
        status = SLSQP_STATUSES.get(found.status, OptimStatus.INACCURATE)
        unconfirmed = status is OptimStatus.FEASIBLE and promised > STATIONARY
        if not unconfirmed or runs == RUNS_MOST:
            break
    message = f"SLSQP: {found.message} after {steps} iterations{where}"
    if unconfirmed:
        status = OptimStatus.INACCURATE
        message += (
            f"; no solution: a relative decrease of {promised:.2g} within {BOX} rad is promised"
        )
    details = {"status": int(found.status), "message": found.message, "iterations": steps}
    return x, status, message, details | {"runs": runs, "promised": promised}


def _chosen(form: Epigraph, z: np.ndarray) -> tuple[np.ndarray, str]:
    """The last point, or the best one on the way where that is better or alone feasible."""
    problem, last = form.near.problem, form.angles(z)
    most = form.best_value + 1e-6 * abs(form.best_value)
    if form.best is None or (problem.is_feasible(last) and problem.objective(last) <= most):
        return last, ""
    return form.best, "; the best feasible point on the way is returned"


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
        each = list(zip(near.criteria, near.weights, at.terms, strict=True))
        counts = [
            0 if one.outer == "square" else 1 if one.kind == "max" else terms.size
            for one, _, terms in each
        ]
        ends = self.n + np.cumsum([0, *counts])
        self.tops = [slice(a, b) for a, b in pairwise(ends)]
        self.cost = np.zeros(ends[-1])
        low, high = (np.full(ends[-1], side) for side in (-np.inf, np.inf))
        low[: self.n], high[: self.n] = near.problem.bounds
        for own, (one, weight, _) in zip(self.tops, each, strict=True):
            self.cost[own] = weight
            low[own] = 0.0 if one.kind == "sum" else -np.inf
        self.bounds = low, high
        self.rates = np.zeros((0, ends[-1]))
        if near.problem.leg_rate is not None:
            per = 1 / (near.problem.leg_rate * np.diff(near.problem.x))
            moves = np.array([[-1, 0, 1, 0], [0, -1, 0, 1]]) * per[:, None, None]
            self.rates = self._rows(np.concatenate([-moves, moves], 1))

    def angles(self, z: np.ndarray) -> np.ndarray:
        """The decision vector within its bounds [2K]."""
        return np.clip(z[: self.n], *self.near.problem.bounds)

    def start(self, x: np.ndarray) -> np.ndarray:
        """x with the least tops that lie above the terms there."""
        z = np.concatenate([x, np.zeros(len(self.cost) - self.n)])
        for one, own, terms in zip(self.near.criteria, self.tops, self.near(x).terms, strict=True):
            if one.outer != "square":
                least = np.max(terms) if one.kind == "max" else np.maximum(terms.ravel(), 0)
                z[own] = least / self.scale
        return z

    def objective(self, z: np.ndarray) -> float:
        """The scaled objective."""
        at = self._at(z)
        squares = [w * np.sum(at.terms[i] ** 2) for i, w in self._squares()]
        return float(self.cost @ z + sum(squares) / self.scale)

    def gradient(self, z: np.ndarray) -> np.ndarray:
        """Its slope [n + tops]."""
        at, slope = self._at(z), self.cost.copy()
        for i, weight in self._squares():
            rows = self._rows(at.term_slopes[i])
            slope += 2 * weight / self.scale * (at.terms[i].ravel() @ rows)
        return slope

    def constraints(self, z: np.ndarray) -> np.ndarray:
        """Epigraph, margin and rate constraints, satisfied where >= 0."""
        at = self._at(z)
        found = [z[own] - at.terms[i].ravel() / self.scale for i, own in self._epigraphs()]
        found += [of.ravel() for of in at.margins.values()]
        return np.concatenate([*found, 1 + self.rates @ z])

    def jacobian(self, z: np.ndarray) -> np.ndarray:
        """Slopes of the constraints [m, n + tops]."""
        at, blocks = self._at(z), []
        for i, own in self._epigraphs():
            block = self._rows(at.term_slopes[i] * (-1 / self.scale))
            count = own.stop - own.start
            block[:, own] = np.eye(count) if count == len(block) else 1.0
            blocks.append(block)
        blocks += [self._rows(of) for of in at.margin_slopes.values()]
        return np.concatenate([*blocks, self.rates])

    def _squares(self) -> list[tuple[int, float]]:
        """Number and weight of each criterion of squares."""
        near = self.near
        return [
            (i, near.weights[i]) for i, one in enumerate(near.criteria) if one.outer == "square"
        ]

    def _epigraphs(self) -> list[tuple[int, slice]]:
        """Number and tops of each of the others."""
        return [(i, own) for i, own in enumerate(self.tops) if own.stop > own.start]

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

    def _rows(self, slopes: Float[np.ndarray, "rows m d"]) -> np.ndarray:
        """Blocks as a matrix [rows m, n + tops]: row k reads z from 2 k on."""
        rows, m, d = slopes.shape
        found = np.zeros((rows, m, len(self.cost)))
        for k in range(rows):
            found[k, :, 2 * k : 2 * k + d] = slopes[k]
        return found.reshape(rows * m, -1)


def solve_cma(
    problem: PostureProblem,
    *,
    progress: bool = False,
    start: Any = "dp",
    angles: Any = None,
    seed: int = 0,
    evaluations: int = 5_000,
    sigma: float = 0.01,
    population: int | None = None,
    penalty: float = 10.0,
) -> PostureResult:
    """The best drive that meets the constraints among those sampled, its start included.

    start, angles: see start_point. seed, evaluations, sigma, population, penalty: see Evolution and
    the method for all problems, which this is but for its start and the objective's scale.
    evaluations: drives. VIOLATED without a feasible one among them, FAILED without a pose to begin.
    """
    package()
    began = time.perf_counter()
    search = evolution(problem, seed, evaluations, sigma, population, penalty)
    drives = f"population = {shown(search.population)} at {len(problem.x)} waypoints"
    require_stations(drives, 2.0 * search.population * len(problem.x))  # up to a power of two
    require_waypoint_matrices(problem, "cma", square=COVARIANCE)
    begun = begin(problem, "cma", start, angles, progress, began)
    if isinstance(begun, PostureResult):
        return begun
    near, x, note = begun
    at = near(x)
    first = (x, near.value(at), near.scale(at))
    return evolve(problem, search, first, began, progress, note=note)
