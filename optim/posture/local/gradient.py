"""Nonlinear programming by scipy, on exact derivatives of the smooth terms and margins.

Positive parts and worst stations have kinks, so each gets a number of its own, a top, that lies
above the terms, and is minimised (epigraph form): all that scipy sees is smooth. z = (leg angles
[2K], tops), everything scaled to about 1:

minimise the sum of weight * tops and squares, subject to terms <= tops, margins >= 0, leg rates.
"""

from __future__ import annotations

import time
import warnings
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import cvxpy as cp
import numpy as np
from scipy.optimize import NonlinearConstraint, OptimizeResult, minimize
from scipy.sparse import block_diag, coo_array, csr_array, hstack, vstack

from stickslip.dynamics.checks import require_choice, require_integer
from stickslip.optim.methods import SLSQP_STATUSES, shortcomings
from stickslip.optim.options import COUNT, require_scalar
from stickslip.optim.posture.finer import result_at
from stickslip.optim.posture.local.linearise import Linear, Near, begin, within_rates
from stickslip.optim.posture.local.scp import ConvexModel
from stickslip.optim.posture.result import PostureResult
from stickslip.optim.posture.waypoints import CONVEX, DENSE, SPARSE, require_waypoint_matrices
from stickslip.optim.progress import Bar
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.posture.local.linearise import Near
    from stickslip.optim.posture.problem import PostureProblem


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


TRUST_STATUSES = {
    0: OptimStatus.LIMIT,
    1: OptimStatus.FEASIBLE,
    2: OptimStatus.FEASIBLE,
    3: OptimStatus.LIMIT,
}
"""scipy's statuses; any other is INACCURATE: it stopped, and not at what it calls a solution."""

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
    scipy_method: str = "SLSQP",
    iterations: int = 200,
    tolerance: float = 1e-8,
) -> PostureResult:
    """A local optimum off the grid, from `start`: see start_point, to which angles goes too.

    scipy_method: "SLSQP", dense, good to some hundred numbers; or "trust-constr", sparse and
    slower. tolerance: SLSQP's ftol, or the gradient's and the box's of trust-constr, of the scaled
    problem. What scipy calls a solution is checked by the convex model of `scp` (see BOX), and
    where that is not content scipy runs again. Of the points tried, the best that meets all
    constraints is returned if the last one does not; value and residuals are the problem's own.

    Nothing is proved of the value: FEASIBLE, LIMIT, VIOLATED, INACCURATE where scipy gave up or
    stopped short at a point that meets the constraints, FAILED without a pose to begin.
    evaluations: linearisations. details: scipy's own status and message, iterations, runs, and
    promised (the relative decrease that the convex model promises within BOX).
    """
    began = time.perf_counter()
    require_choice("scipy_method", scipy_method, tuple(RUNS))
    iterations = require_integer("iterations", iterations, high=COUNT)
    require_scalar("tolerance", tolerance, low=0.0, strict=True, accepted="a number > 0")
    dense = scipy_method == "SLSQP"
    require_waypoint_matrices(
        problem, scipy_method, CONVEX if dense else SPARSE, DENSE if dense else 0.0
    )
    begun = begin(problem, "gradient", start, angles, progress, began)
    if isinstance(begun, PostureResult):
        return begun
    near, x, note = begun
    with Bar("gradient", iterations, "iteration", progress) as bar:
        last = _last_run(near, x, scipy_method, iterations, tolerance, bar)
    status, why = last.ended()
    return result_at(
        problem,
        last.x,
        method="gradient",
        began=began,
        status=status,
        evaluations=near.evaluations,
        message=f"{note}{scipy_method}: {last.message} after {last.iterations} iterations{why}"
        f"{shortcomings(problem, last.x)}",
        details={
            "status": last.code,
            "message": last.message,
            "iterations": last.iterations,
            "runs": last.runs,
            "promised": last.promised,
        },
    )


class _Run(NamedTuple):
    """A run of scipy and what the convex model makes of its end."""

    x: np.ndarray
    where: str
    """A sentence where this is not scipy's last point."""
    code: int
    """scipy's status."""
    status: OptimStatus
    message: str
    promised: float
    """Relative decrease that the model promises within BOX."""
    iterations: int
    """Iterations of this run and those before it."""
    runs: int

    @property
    def content(self) -> bool:
        """True if the model is content with what scipy calls a solution."""
        return self.promised <= STATIONARY

    def ended(self) -> tuple[OptimStatus, str]:
        """The status, and why in words."""
        if self.status is not OptimStatus.FEASIBLE or self.content:
            return self.status, self.where
        decrease = f"a relative decrease of {self.promised:.2g} within {BOX} rad is promised"
        return OptimStatus.INACCURATE, f"{self.where}; no solution: {decrease}"


def _last_run(
    near: Near, x: np.ndarray, scipy_method: str, iterations: int, tolerance: float, bar: Bar
) -> _Run:
    """Run scipy, repeatedly where the convex model does not confirm its solution."""
    form, model = Epigraph(near, x), ConvexModel(near, x, cp.CLARABEL)
    minimised, statuses = RUNS[scipy_method]
    steps = runs = 0
    while True:
        inward = x + INWARD * (inside_of(near.problem) - x)
        found = minimised(form, inward, iterations - steps, tolerance, bar)
        steps, runs = steps + found.nit, runs + 1
        x, where = _chosen(form, found.x)
        promised = model.promised(near, x, BOX)
        status = statuses.get(found.status, OptimStatus.INACCURATE)
        run = _Run(x, where, int(found.status), status, found.message, promised, steps, runs)
        if status is not OptimStatus.FEASIBLE or run.content or runs == RUNS_MOST:
            return run


def _chosen(form: Epigraph, z: np.ndarray) -> tuple[np.ndarray, str]:
    """The last point, or the best one on the way where that is better or alone feasible."""
    last = form.angles(z)
    if form.best is None or _good(form.near.problem, last, form.best_value):
        return last, ""
    return form.best, "; the best feasible point on the way is returned"


def inside_of(problem: PostureProblem) -> np.ndarray:
    """A point well inside the bounds and the leg rates, where there is room."""
    low, high = problem.bounds
    middle = (low + high) / 2
    inside = within_rates(problem, middle)
    return middle if inside is None else inside


def _good(problem: PostureProblem, x: np.ndarray, best: float) -> bool:
    """True if x meets the constraints and is about as good as the best point on the way."""
    return problem.is_feasible(x) and problem.objective(x) <= best + 1e-6 * abs(best)


def _slsqp(
    form: Epigraph, x: np.ndarray, iterations: int, tolerance: float, bar: Bar
) -> OptimizeResult:
    return minimize(
        form.objective,
        form.start(x),
        jac=form.gradient,
        bounds=list(zip(*form.bounds, strict=True)),
        constraints={
            "type": "ineq",
            "fun": form.constraints,
            "jac": lambda z: form.jacobian(z).toarray(),
        },
        method="SLSQP",
        options={"maxiter": iterations, "ftol": tolerance},
        callback=lambda z: bar.advance(),
    )


def _trust(
    form: Epigraph, x: np.ndarray, iterations: int, tolerance: float, bar: Bar
) -> OptimizeResult:
    slopes: Any = form.jacobian
    inside = NonlinearConstraint(form.constraints, 0.0, np.inf, jac=slopes)

    def advance(intermediate_result: OptimizeResult) -> None:
        bar.advance()

    with warnings.catch_warnings():
        # Rows of linear constraints, whose curvature is found to be none.
        warnings.filterwarnings("ignore", "delta_grad == 0.0")
        return minimize(
            form.objective,
            form.start(x),
            jac=form.gradient,
            hess=form.hessian,
            bounds=list(zip(*form.bounds, strict=True)),
            constraints=inside,
            method="trust-constr",
            options={"maxiter": iterations, "gtol": tolerance, "xtol": tolerance},
            callback=advance,
        )


RUNS = {"SLSQP": (_slsqp, SLSQP_STATUSES), "trust-constr": (_trust, TRUST_STATUSES)}
