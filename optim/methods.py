"""Methods for every problem: SLSQP of scipy on a problem's own slopes (dense, for hundreds of
numbers), and evolution by the package cma (extra "optim").

Evolution sees values only: the objective of whole generations at once, and an exact penalty for
violated constraints. From a good start it polishes; it is no global search in hundreds of numbers.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import minimize

from stickslip.dynamics.checks import require_integer, require_memory
from stickslip.dynamics.lazily import require
from stickslip.optim.problem import COUNT, OptimStatus, Problem, Result, require_scalar
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Float


SLSQP_STATUSES = {0: OptimStatus.FEASIBLE, 9: OptimStatus.LIMIT}
"""SLSQP's; any other is INACCURATE: it stopped, and not at what it calls a solution."""
PROBES = 8
"""Points over the bounds that say how much the objective changes."""
GRADIENT_SCALE, CMA_SCALE = (0.01, 100.0), (1.0, 1e3)
"""Parts of that change which the value at the start counts as, at least and at most (see size_of).
Of cma, a scale that is too small would have penalties be cheap."""
DENSE, COVARIANCE = 64, 40
"""Memory of a pair of numbers in SLSQP's and in cma's matrices [bytes]."""
SAMPLE = 64
"""Bytes of a number of a sample, and of what computing it takes, at least."""
FLOOR = 1e-9
"""Violations below this, in scaled margins, cost no penalty: they are rounding."""


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
        others = np.array([problem.objective(one) for one in scattered(problem, PROBES)])
        self.free, self.evaluations = problem.free, 1 + PROBES
        self.bounds = self.free.bounds
        self.constraints, self.jacobian = self.free.constraints, self.free.jacobian
        self.scale = size_of(value, others, *GRADIENT_SCALE)
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
        """The last point, or the best feasible one on the way where that is better, and a note."""
        x = np.clip(x, *self.bounds)
        at = self.free.evaluate(x)
        last = at.value if at.feasible else np.inf
        if self.best is None or last <= self.best_value + 1e-12 * abs(self.best_value):
            return self.free.expand(x), ""
        return self.free.expand(self.best), "; the best feasible point on the way is returned"


def solve_cma(
    problem: Problem[Any],
    *,
    progress: bool = False,
    start: Any = None,
    seed: int = 0,
    evaluations: int = 5_000,
    sigma: float = 0.01,
    population: int | None = None,
    penalty: float = 10.0,
) -> Result:
    """The best point that meets the constraints among those sampled, its start included.

    start: see Problem.start_point; bounds must be finite. seed: of the samples; nothing else is
    random, and NumPy's global state is neither read nor written. evaluations: at most, to whole
    generations, besides those before it begins. sigma: first standard deviation, as a part of each
    number's range. population: of a generation; None for cma's 4 + 3 log(n) of the n numbers that
    are free; given ones are not searched. penalty: price of a violated scaled margin, of the
    objective's scale. The objective's scale is its value at the start, or what it changes by from
    there to one generation over the whole of the bounds where that is more.

    Nothing is proved: FEASIBLE where cma's own criteria stopped it, LIMIT at `evaluations`,
    VIOLATED without a feasible sample (the message says what stopped it), FAILED without a value to
    begin with. evaluations: points, with the start's and that generation's. details: stop (cma's
    reasons), seed. ImportError without the package.
    """
    library = require("cma", "the method 'cma'", "optim")
    began = time.perf_counter()
    for name, number in (("sigma", sigma), ("penalty", penalty)):
        require_scalar(name, number, low=0.0, strict=True, accepted="a number > 0")
    evaluations = require_integer("evaluations", evaluations, high=COUNT)
    seed = require_integer("seed", seed, low=0, high=2**64)
    free = problem.free
    if population is None:
        population = 4 + int(3 * np.log(max(free.n, 1)))
    accepted = "None, or an integer >= 2"
    population = require_integer("population", population, low=2, high=COUNT, accepted=accepted)
    given = f"population = {population} of {problem.n} numbers"
    require_memory(given, "numbers", 2.0 * population * problem.n, SAMPLE)
    given = f"method = 'cma' with n = {problem.n}"
    require_memory(given, "rows", problem.n, COVARIANCE * problem.n)
    begun = problem.begin("cma", start, progress, began)
    if isinstance(begun, Result):
        return begun
    x, value, note = begun
    others = problem.objectives(scattered(problem, population))
    scale = size_of(value, others, *CMA_SCALE)
    count, best = 1, (value if problem.is_feasible(x) else np.inf)
    low, high = free.bounds
    first = np.clip((free.reduce(x) - low) / (high - low), 0, 1)
    options = own_draws(seed) | {"bounds": [0.0, 1.0], "maxfevals": evaluations}
    options |= {"popsize": population, "verbose": -9, "verb_log": 0, "verb_disp": 0}
    strategy = library.CMAEvolutionStrategy(first, sigma, options)
    with Bar("cma", evaluations, "evaluation", progress) as bar:
        while not strategy.stop():
            asked = strategy.ask()
            X = free.expand(low + np.clip(np.array(asked), 0, 1) * (high - low))
            values, violation = problem.sample(X)
            count += len(X)
            violation = np.where(violation > FLOOR, violation, 0.0)
            feasible = np.where(violation > 0, np.inf, values)
            if np.min(feasible) < best:
                x, best = X[np.argmin(feasible)], float(np.min(feasible))
            priced = values / scale + penalty * violation
            strategy.tell(asked, list(np.where(np.isfinite(priced), priced, np.inf)))
            bar.advance(len(asked), f"{best:.6g}")
    stop = dict(strategy.stop())
    return problem.result(
        x,
        method="cma",
        began=began,
        status=OptimStatus.LIMIT if "maxfevals" in stop else OptimStatus.FEASIBLE,
        evaluations=count + len(others),
        message=f"{note}stopped by {', '.join(stop)} after {count} evaluations"
        f"{problem.shortcomings(x)}",
        details={"stop": stop, "seed": seed},
    )


def own_draws(seed: int) -> dict[str, object]:
    """Options of cma with which it draws of the seed alone and leaves NumPy's global state alone.

    By itself it takes the seed 0 for the time of day.
    """
    drawn = np.random.default_rng(seed).standard_normal
    return {"seed": np.nan, "randn": lambda *shape: drawn(shape)}


def scattered(problem: Problem[Any], count: int) -> Float[np.ndarray, "count n"]:
    """Points over the whole of the bounds, the same at every call."""
    low, high = problem.bounds
    return np.random.default_rng(0).uniform(low, high, (count, len(low)))


def size_of(value: float, others: np.ndarray, least: float, most: float) -> float:
    """A positive size of an objective, to divide it by: |value| at the start, within `least` and
    `most` of what the objective typically changes by from there to `others`. So neither a start of
    value 0 nor a constant that is added to all of them decides."""
    change = np.abs(others[np.isfinite(others)] - value)
    if not np.any(change):
        return abs(value) or 1.0
    typical = max(float(np.median(change)), 1e-9 * max(abs(value), float(np.max(change))))
    return float(np.clip(abs(value), least * typical, most * typical))
