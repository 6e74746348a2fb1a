"""Methods for every problem: SLSQP of scipy on a problem's own slopes (dense, for hundreds of
numbers), and evolution by the package cma (extra "optim").

Evolution sees values only: the objective of whole generations at once, and an exact penalty for
violated constraints. With a start that is good it polishes; it is no global search in hundreds of
numbers.
"""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from stickslip.dynamics.checks import require_integer, require_memory
from stickslip.optim.options import COUNT, as_floats, require_scalar
from stickslip.optim.progress import Bar
from stickslip.optim.result import OptimStatus, Result

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.problem import Problem

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
        found = slsqp(run, run.free.reduce(begun[0]), iterations, tolerance, bar)
    x, why = run.chosen(found.x)
    return problem.result(
        x,
        method="gradient",
        began=began,
        status=SLSQP_STATUSES.get(found.status, OptimStatus.INACCURATE),
        evaluations=run.evaluations,
        message=f"SLSQP: {found.message} after {found.nit} iterations{why}"
        f"{problem.shortcomings(x)}",
        details={
            "status": int(found.status),
            "message": found.message,
            "iterations": int(found.nit),
        },
    )


def slsqp(
    problem: Any, start: np.ndarray, iterations: int, tolerance: float, bar: Bar
) -> OptimizeResult:
    """scipy's SLSQP from a start; the bar advances with each iteration.

    problem: bounds, and objective, gradient, constraints and jacobian as Problem has them.
    """
    return minimize(
        problem.objective,
        start,
        jac=problem.gradient,
        bounds=list(zip(*problem.bounds, strict=True)),
        constraints={"type": "ineq", "fun": problem.constraints, "jac": problem.jacobian},
        method="SLSQP",
        options={"maxiter": iterations, "ftol": tolerance},
        callback=lambda x: bar.advance(),
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
        """Of the objective."""
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

    start: a decision vector; None: the middle of the bounds, which must be finite. The others: see
    Evolution; population: None for cma's 4 + 3 log(n) of the n numbers that are free; given ones
    are not searched. The objective's scale is its value at the start, or what it changes by from
    there to one generation over the whole of the bounds where that is more.

    Nothing is proved: FEASIBLE where cma's own criteria stopped it, LIMIT at `evaluations`,
    VIOLATED without a feasible sample (the message says what stopped it), FAILED without a value to
    begin with. evaluations: points, with the start's and that generation's. details: stop (cma's
    reasons), seed. ImportError without the package.
    """
    package()
    began = time.perf_counter()
    search = evolution(problem, seed, evaluations, sigma, population, penalty)
    size = f"population = {search.population} of {problem.n} numbers"
    require_memory(size, "numbers", 2.0 * search.population * problem.n, SAMPLE)
    require_memory(
        f"method = 'cma' with n = {problem.n}", "rows", problem.n, COVARIANCE * problem.n
    )
    begun = begin(problem, "cma", start, began)
    if isinstance(begun, Result):
        return begun
    x, value = begun
    others = problem.objectives(scattered(problem, search.population))
    scale = size_of(value, others, *CMA_SCALE)
    return evolve(problem, search, (x, value, scale), began, progress, others=len(others))


class Evolution(NamedTuple):
    """Settings of cma. seed: of the samples; nothing else is random, and NumPy's global state is
    neither read nor written. evaluations: of the objective, at most, to whole generations, besides
    those before it begins. sigma: first standard deviation, as a part of each number's range.
    population: of a generation. penalty: price of a violated scaled margin, of the objective's
    scale."""

    seed: int
    evaluations: int
    sigma: float
    population: int
    penalty: float


def evolution(
    problem: Problem[Any], seed: Any, evaluations: Any, sigma: Any, population: Any, penalty: Any
) -> Evolution:
    """The settings, checked; ValueError naming a bad one."""
    for name, value in (("sigma", sigma), ("penalty", penalty)):
        require_scalar(name, value, low=0.0, strict=True, accepted="a number > 0")
    evaluations = require_integer("evaluations", evaluations, high=COUNT)
    seed = require_integer("seed", seed, low=0, high=2**64)
    size = 4 + int(3 * np.log(max(problem.free.n, 1)))
    if population is not None:
        accepted = "None, or an integer >= 2"
        size = require_integer("population", population, low=2, high=COUNT, accepted=accepted)
    return Evolution(seed, evaluations, float(sigma), size, float(penalty))


def evolve(
    problem: Problem[Any],
    search: Evolution,
    begin: tuple[np.ndarray, float, float],
    began: float,
    progress: bool,
    *,
    others: int = 0,
    note: str = "",
) -> Any:
    """The problem's result of sampling in the unit box of the numbers that are free.

    begin: a point, its value, and the objective's size, to divide it by. others: evaluations before
    it. note: begins the message.
    """
    x, value, scale = begin
    free, count, best = problem.free, 1, (value if problem.is_feasible(x) else np.inf)
    low, high = free.bounds
    first = np.clip((free.reduce(x) - low) / (high - low), 0, 1)
    strategy = package().CMAEvolutionStrategy(first, search.sigma, _options(search))
    with Bar("cma", search.evaluations, "evaluation", progress) as bar:
        while not strategy.stop():
            asked = strategy.ask()
            X = free.expand(low + np.clip(np.array(asked), 0, 1) * (high - low))
            values, violation = problem.sample(X)
            count += len(X)
            violation = np.where(violation > FLOOR, violation, 0.0)
            feasible = np.where(violation > 0, np.inf, values)
            if np.min(feasible) < best:
                x, best = X[np.argmin(feasible)], float(np.min(feasible))
            priced = values / scale + search.penalty * violation
            strategy.tell(asked, list(np.where(np.isfinite(priced), priced, np.inf)))
            bar.advance(len(asked), f"{best:.6g}")
    stop = dict(strategy.stop())
    return problem.result(
        x,
        method="cma",
        began=began,
        status=OptimStatus.LIMIT if "maxfevals" in stop else OptimStatus.FEASIBLE,
        evaluations=count + others,
        message=f"{note}stopped by {', '.join(stop)} after {count} evaluations"
        f"{problem.shortcomings(x)}",
        details={"stop": stop, "seed": search.seed},
    )


def _options(search: Evolution) -> dict[str, Any]:
    """Options of cma: quiet, within the unit box."""
    return own_draws(search.seed) | {
        "bounds": [0.0, 1.0],
        "maxfevals": search.evaluations,
        "popsize": search.population,
        "verbose": -9,
        "verb_log": 0,
        "verb_disp": 0,
    }


def own_draws(seed: int) -> dict[str, object]:
    """Options of cma with which it draws of the seed alone and leaves NumPy's global state alone.

    By itself it takes the seed 0 for the time of day.
    """
    return {"seed": np.nan, "randn": partial(_normal, np.random.default_rng(seed))}


def _normal(rng: np.random.Generator, *shape: int) -> np.ndarray:
    return rng.standard_normal(shape)


def package() -> Any:
    """The package cma, or ImportError saying how to get it."""
    try:
        import cma
    except ImportError as error:
        raise ImportError("the method 'cma' needs cma: pip install 'stickslip[optim]'") from error
    return cma


def begin(
    problem: Problem[Any], method: str, start: Any, began: float
) -> tuple[Float[np.ndarray, "n"], float] | Result:
    """A point within the bounds and its value: `start`, or for None the bounds' middle. Or the
    result, where there is no value at it, or no choice. ValueError without finite bounds."""
    low, high = problem.bounds
    if not (np.all(np.isfinite(low)) and np.all(np.isfinite(high))):
        raise ValueError("bounds are not finite; accepted by methods that search: finite bounds")
    if start is None:
        x = (low + high) / 2
    else:
        accepted = f"None, or {problem.n} finite numbers"
        x = as_floats("start", start, accepted)
        if x.shape != (problem.n,):
            raise ValueError(f"start has shape {x.shape}; accepted: {accepted}")
        x = np.clip(x, low, high)
    value = problem.objective(x)
    if problem.free.n == 0:
        status, why = OptimStatus.FEASIBLE, "every number is given"
    elif not np.isfinite(value):
        status, why = OptimStatus.FAILED, "where it begins there is no value"
    else:
        return x, value
    result = {"method": method, "began": began, "status": status, "evaluations": 1}
    return problem.result(x, message=why + problem.shortcomings(x), **result)


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
