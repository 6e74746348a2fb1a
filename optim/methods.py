"""The method for every problem with slopes: SLSQP of scipy, dense, for hundreds of numbers."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import minimize

from stickslip.dynamics.checks import require_integer, require_memory
from stickslip.optim.problem import COUNT, require_scalar
from stickslip.optim.progress import Bar
from stickslip.optim.result import OptimStatus, Result

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.problem import Problem

SLSQP_STATUSES = {0: OptimStatus.FEASIBLE, 9: OptimStatus.LIMIT}
"""SLSQP's; any other is INACCURATE: it stopped, and not at what it calls a solution."""
PROBES = 8
"""Points over the bounds that say how much the objective changes."""
LEAST_SIZE, MOST_SIZE = 0.01, 100.0
"""Parts of that change which the value at the start counts as, at least and at most (see size_of).
"""
DENSE = 64
"""Memory of a pair of numbers in SLSQP's matrices [bytes]."""


def solve_gradient(
    problem: Problem[Any],
    *,
    progress: bool = False,
    start: Any = None,
    iterations: int = 200,
    tolerance: float = 1e-8,
) -> Result:
    """A local optimum from `start`: see Problem.start_point.

    tolerance: SLSQP's ftol, of the objective in parts of its size: its value at the start, or what
    it changes by over the bounds (PROBES points) where that is far from it. The best of the points
    tried that meet all constraints is returned where the last one does not.

    Nothing is proved of the value: FEASIBLE, LIMIT, VIOLATED where no point tried met the
    constraints (the message says how scipy ended), INACCURATE where scipy gave up at a point that
    meets them, FAILED without a value to begin with. evaluations: of value and slopes, PROBES
    included. details: scipy's own status, message and iterations.
    """
    began = time.perf_counter()
    iterations = require_integer("iterations", iterations, high=COUNT)
    require_scalar("tolerance", tolerance, low=0.0, strict=True, accepted="a number > 0")
    given = f"method = 'gradient' with n = {problem.n}"
    require_memory(given, "rows", problem.n, DENSE * problem.n)
    begun = problem.begin("gradient", start, progress, began)
    if isinstance(begun, Result):
        return begun
    start, value, note = begun
    run = _Run(problem, start, value)
    with Bar("gradient", iterations, "iteration", progress) as bar:
        found = minimize(
            run.objective,
            run.free.reduce(start),
            jac=run.gradient,
            bounds=list(zip(*run.bounds, strict=True)),
            constraints={"type": "ineq", "fun": run.constraints, "jac": run.jacobian},
            method="SLSQP",
            options={"maxiter": iterations, "ftol": tolerance},
            callback=lambda x: bar.advance(),
        )
    x, why = run.chosen(found.x)
    return problem.result(
        x,
        method="gradient",
        began=began,
        status=SLSQP_STATUSES.get(found.status, OptimStatus.INACCURATE),
        evaluations=run.evaluations,
        message=f"{note}SLSQP: {found.message} after {found.nit} iterations{why}"
        f"{problem.shortcomings(x)}",
        details={
            "status": int(found.status),
            "message": found.message,
            "iterations": int(found.nit),
        },
    )


class _Run:
    """The objective in parts of its size, in the free numbers, noting the best point met."""

    def __init__(self, problem: Problem[Any], x: np.ndarray, value: float):
        others = np.array([problem.objective(one) for one in scattered(problem)])
        self.free, self.evaluations = problem.free, 1 + PROBES
        self.bounds = self.free.bounds
        self.constraints, self.jacobian = self.free.constraints, self.free.jacobian
        self.scale = size_of(value, others)
        self.best: np.ndarray | None = None
        self.best_value = np.inf

    def objective(self, x: np.ndarray) -> float:
        """Scaled; SLSQP may step outside the bounds by a rounding."""
        x = np.clip(x, *self.bounds)
        at = self.free.evaluate(x)
        self.evaluations += 1
        if at.feasible and at.value < self.best_value:
            self.best, self.best_value = x, at.value
        return at.value / self.scale

    def gradient(self, x: np.ndarray) -> np.ndarray:
        return self.free.gradient(np.clip(x, *self.bounds)) / self.scale

    def chosen(self, x: np.ndarray) -> tuple[np.ndarray, str]:
        """The last point, or the best one on the way where the last does not meet all or is worse;
        a sentence where that is so."""
        x = np.clip(x, *self.bounds)
        at = self.free.evaluate(x)
        last = at.value if at.feasible else np.inf
        if self.best is None or last <= self.best_value + 1e-12 * abs(self.best_value):
            return self.free.expand(x), ""
        return self.free.expand(self.best), "; the best feasible point on the way is returned"


def scattered(problem: Problem[Any]) -> Float[np.ndarray, "PROBES n"]:
    """Points over the whole of the bounds, the same at every call."""
    low, high = problem.bounds
    return np.random.default_rng(0).uniform(low, high, (PROBES, len(low)))


def size_of(value: float, others: np.ndarray) -> float:
    """A positive size of an objective, to divide it by: |value| at the start, within LEAST_SIZE and
    MOST_SIZE of what the objective typically changes by from there to `others`. So neither a start
    of value 0 nor a constant that is added to all of them decides."""
    change = np.abs(others[np.isfinite(others)] - value)
    if not np.any(change):
        return abs(value) or 1.0
    typical = max(float(np.median(change)), 1e-9 * max(abs(value), float(np.max(change))))
    return float(np.clip(abs(value), LEAST_SIZE * typical, MOST_SIZE * typical))
