"""Evolution by the covariance matrix adaptation strategy of the package cma (extra "optim").

It sees values only: the objective of whole generations at once, and an exact penalty for missed
constraints. With a start that is good it polishes; it is no global search in hundreds of numbers.
"""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stickslip.dynamics.checks import require_integer, require_memory
from stickslip.optim.options import COUNT, require_scalar
from stickslip.optim.problem import scattered, size_of
from stickslip.optim.progress import Bar
from stickslip.optim.result import OptimStatus, Result
from stickslip.optim.start import begin, shortcomings

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.problem import Problem

FLOOR = 1e-9
"""Violations below this, in scaled margins, cost no penalty: they are rounding."""
LEAST, MOST = 1.0, 1e3
"""Weight of the value at the start in the objective's scale, in parts of what the objective
changes by over the bounds: see size_of. A scale that is too small would have penalties be cheap."""
SAMPLE = 64
"""Bytes of a number of a sample, and of what computing it takes, at least."""
COVARIANCE = 40
"""Memory of a pair of numbers in cma's matrices [bytes]."""


class Evolution(NamedTuple):
    """Settings of cma. seed: of the samples; nothing else is random, and NumPy's global state is
    neither read nor written. evaluations: of the objective, at most, to whole generations, besides
    those before it begins. sigma: first standard deviation, as a part of each number's range.
    population: of a generation. penalty: price of a missed scaled margin, of the objective's
    scale."""

    seed: int
    evaluations: int
    sigma: float
    population: int
    penalty: float


class Evolved(NamedTuple):
    """The best point of those sampled, the start included, and how the search ended."""

    x: np.ndarray
    evaluations: int
    stop: dict[str, Any]

    @property
    def status(self) -> OptimStatus:
        """LIMIT where the evaluations ran out, FEASIBLE where cma's own criteria ended it."""
        return OptimStatus.LIMIT if "maxfevals" in self.stop else OptimStatus.FEASIBLE

    @property
    def words(self) -> str:
        """Text for a message."""
        return f"stopped by {', '.join(self.stop)} after {self.evaluations} evaluations"


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
    found = evolve(problem, search, x, value, size_of(value, others, LEAST, MOST), progress)
    return problem.result(
        found.x,
        method="cma",
        began=began,
        status=found.status,
        evaluations=found.evaluations + len(others),
        message=found.words + shortcomings(problem, found.x),
        details={"stop": found.stop, "seed": search.seed},
    )


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
    x: np.ndarray,
    value: float,
    scale: float,
    progress: bool,
) -> Evolved:
    """Sample about x, whose value is given; scale: the objective's size, to divide it by."""
    samples = _Samples(problem, x, value, scale, search.penalty)
    options: dict[str, Any] = {
        "bounds": [0.0, 1.0],
        **own_draws(search.seed),
        "maxfevals": search.evaluations,
        "popsize": search.population,
        "verbose": -9,
        "verb_log": 0,
        "verb_disp": 0,
    }
    strategy: Any = package().CMAEvolutionStrategy(samples.first, search.sigma, options)
    with Bar("cma", search.evaluations, "evaluation", progress) as bar:
        while not strategy.stop():
            asked = strategy.ask()
            strategy.tell(asked, list(samples.values(np.array(asked))))
            bar.advance(len(asked), f"{samples.best_value:.6g}")
    return Evolved(samples.best, samples.count, dict(strategy.stop()))


def own_draws(seed: int) -> dict[str, object]:
    """Options of cma with which it draws of the seed alone and leaves NumPy's global state alone.

    By itself it takes the seed 0 for the time of day.
    """
    return {"seed": np.nan, "randn": partial(_normal, np.random.default_rng(seed))}


def _normal(rng: np.random.Generator, *shape: int) -> np.ndarray:
    return rng.standard_normal(shape)


class _Samples:
    """Objective and penalty of points in the unit box of the numbers that are free.

    first: the start there. best: the best point that misses nothing, or else the start.
    """

    def __init__(
        self, problem: Problem[Any], x: np.ndarray, value: float, scale: float, penalty: float
    ):
        self.problem, self.penalty, self.scale, self.count = problem, penalty, scale, 1
        self.low, high = problem.free.bounds
        self.range = high - self.low
        self.first = np.clip((problem.free.reduce(x) - self.low) / self.range, 0, 1)
        self.best = x
        self.best_value = value if problem.is_feasible(x) else np.inf

    def values(self, points: Float[np.ndarray, "B free"]) -> np.ndarray:
        """Values that cma minimises, [B]; infinite where there is no value."""
        X = self.problem.free.expand(self.low + np.clip(points, 0, 1) * self.range)
        value, missed = self.problem.sample(X)
        self.count += len(X)
        met = np.where(missed > FLOOR, np.inf, value)
        i = int(np.argmin(met))
        if met[i] < self.best_value:
            self.best, self.best_value = X[i], float(met[i])
        priced = value / self.scale + self.penalty * np.where(missed > FLOOR, missed, 0.0)
        return np.where(np.isfinite(priced), priced, np.inf)


def package() -> Any:
    """The package cma, or ImportError saying how to get it."""
    try:
        import cma
    except ImportError as error:
        raise ImportError("the method 'cma' needs cma: pip install 'stickslip[optim]'") from error
    return cma
