"""Nonlinear programming by SLSQP of scipy on a problem's own slopes; dense, for hundreds."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from stickslip.dynamics.checks import require_integer, require_memory
from stickslip.optim.options import COUNT, require_scalar
from stickslip.optim.problem import scattered, size_of
from stickslip.optim.progress import Bar
from stickslip.optim.result import OptimStatus, Result
from stickslip.optim.start import begin, shortcomings

if TYPE_CHECKING:
    from stickslip.optim.problem import Problem

SLSQP_STATUSES = {0: OptimStatus.FEASIBLE, 9: OptimStatus.LIMIT}
"""SLSQP's; any other is INACCURATE: it stopped, and not at what it calls a solution."""
PROBES = 8
"""Points over the bounds that say how much the objective changes, and LEAST, MOST: the parts of
that which its value at the start counts as, at least and at most (see size_of)."""
LEAST, MOST = 0.01, 100.0
DENSE = 64
"""Bytes of a pair of numbers in SLSQP's matrices."""


def solve_gradient(
    problem: Problem[Any],
    *,
    progress: bool = False,
    start: Any = None,
    iterations: int = 200,
    tolerance: float = 1e-8,
) -> Result:
    """A local optimum from `start`, a decision vector; None: the middle of the bounds.

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
    require_memory(
        f"method = 'gradient' with n = {problem.n}", "rows", problem.n, DENSE * problem.n
    )
    begun = begin(problem, "gradient", start, began)
    if isinstance(begun, Result):
        return begun
    run = _Run(problem, *begun)
    with Bar("gradient", iterations, "iteration", progress) as bar:
        found = run.minimised(iterations, tolerance, bar)
    x, why = run.chosen(found.x)
    return problem.result(
        x,
        method="gradient",
        began=began,
        status=SLSQP_STATUSES.get(found.status, OptimStatus.INACCURATE),
        evaluations=run.evaluations,
        message=f"SLSQP: {found.message} after {found.nit} iterations{why}"
        f"{shortcomings(problem, x)}",
        details={
            "status": int(found.status),
            "message": found.message,
            "iterations": int(found.nit),
        },
    )


class _Run:
    """The objective in parts of its size, in the free numbers, noting the best point met."""

    def __init__(self, problem: Problem[Any], x: np.ndarray, value: float):
        others = np.array([problem.objective(one) for one in scattered(problem, PROBES)])
        self.free, self.evaluations = problem.free, 1 + PROBES
        self.scale = size_of(value, others, LEAST, MOST)
        self.first = self.free.reduce(x)
        self.best: np.ndarray | None = None
        self.best_value = np.inf

    def minimised(self, iterations: int, tolerance: float, bar: Bar) -> OptimizeResult:
        """scipy's answer."""
        free = self.free
        return minimize(
            self.value,
            self.first,
            jac=self.slope,
            bounds=list(zip(*free.bounds, strict=True)),
            constraints={"type": "ineq", "fun": free.constraints, "jac": free.jacobian},
            method="SLSQP",
            options={"maxiter": iterations, "ftol": tolerance},
            callback=lambda x: bar.advance(),
        )

    def value(self, x: np.ndarray) -> float:
        """Scaled; SLSQP may step outside the bounds by a rounding."""
        x = np.clip(x, *self.free.bounds)
        at = self.free.evaluate(x)
        self.evaluations += 1
        if at.feasible and at.value < self.best_value:
            self.best, self.best_value = x, at.value
        return at.value / self.scale

    def slope(self, x: np.ndarray) -> np.ndarray:
        """Gradient of `value`."""
        return self.free.gradient(np.clip(x, *self.free.bounds)) / self.scale

    def chosen(self, x: np.ndarray) -> tuple[np.ndarray, str]:
        """The last point, or the best one on the way where the last does not meet all or is worse;
        a sentence where that is so."""
        x = np.clip(x, *self.free.bounds)
        at = self.free.evaluate(x)
        last = at.value if at.feasible else np.inf
        if self.best is None or last <= self.best_value + 1e-12 * abs(self.best_value):
            return self.free.expand(x), ""
        return self.free.expand(self.best), "; the best feasible point on the way is returned"
