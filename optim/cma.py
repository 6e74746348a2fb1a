"""Evolution by the covariance matrix adaptation strategy of the package cma (extra "optim").

It sees values only: the objective of whole generations at once, and an exact penalty for missed
constraints. With a start that is good it polishes; it is no global search in 2K numbers.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_integer, shown
from stickslip.optim import posture as traced
from stickslip.optim.linearise import Near, without_criterion
from stickslip.optim.posture import Posture
from stickslip.optim.progress import Bar
from stickslip.optim.result import OptimStatus, Result
from stickslip.optim.sizes import COUNT, COVARIANCE, require_stations, require_waypoint_matrices
from stickslip.optim.starts import begin, shortcomings
from stickslip.optim.waypoints import require_scalar

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.optim.problem import PostureProblem
    from stickslip.optim.station import Station

FLOOR = 1e-9
"""What is missed by less than this, in scaled margins, costs no penalty: it is rounding."""


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
) -> Result:
    """The best point that meets the constraints among those sampled, its start included.

    start, angles: see start_point. seed: of the samples; nothing else is random, and NumPy's
    global state is neither read nor written. evaluations: of the objective, at most, to whole
    generations, besides the start's own. sigma: first standard deviation, as a part of each
    angle's range. population: of a generation, None for cma's 4 + 3 log(n) of the n angles
    that are free; given ends are not searched. penalty: price of a missed scaled margin, of the
    objective's scale.

    Nothing is proved: FEASIBLE where cma's own criteria stopped it, LIMIT at `evaluations`,
    VIOLATED without a feasible sample, FAILED without a pose to begin. evaluations: drives.
    details: stop (cma's reasons), seed. ImportError without the package.
    """
    cma = _package()
    began = time.perf_counter()
    for name, value in (("sigma", sigma), ("penalty", penalty)):
        require_scalar(name, value, low=0.0, strict=True, accepted="a number > 0")
    evaluations = require_integer("evaluations", evaluations, high=COUNT)
    seed = require_integer("seed", seed, low=0, high=2**64)
    population = _population(problem, population)
    begun = begin(problem, "cma", start, angles, progress, began)
    if isinstance(begun, Result):
        return begun
    near, x, note = begun
    samples = _Samples(near, x, penalty)
    rng = np.random.default_rng(seed)
    options: dict[str, Any] = {
        "bounds": [0.0, 1.0],
        "seed": np.nan,  # leaves NumPy's global state alone
        "randn": lambda *shape: rng.standard_normal(shape),
        "maxfevals": evaluations,
        "verbose": -9,
        "verb_log": 0,
        "verb_disp": 0,
    }
    options["popsize"] = population
    strategy: Any = cma.CMAEvolutionStrategy(samples.first, sigma, options)
    with Bar("cma", evaluations, "evaluation", progress) as bar:
        while not strategy.stop():
            asked = strategy.ask()
            strategy.tell(asked, list(samples.values(np.array(asked))))
            bar.advance(len(asked), f"{samples.best_value:.6g}")
    stop: dict[str, Any] = dict(strategy.stop())
    status = OptimStatus.LIMIT if "maxfevals" in stop else OptimStatus.FEASIBLE
    return Result.at(
        problem,
        samples.best,
        method="cma",
        began=began,
        status=status,
        evaluations=samples.count,
        message=f"{note}stopped by {', '.join(stop)} after {samples.count} evaluations"
        f"{shortcomings(problem, samples.best)}",
        details={"stop": stop, "seed": seed},
    )


def _population(problem: PostureProblem, given: Any) -> int:
    """How many drives a generation has; refused where they, or cma's matrices, do not fit."""
    size = 4 + int(3 * np.log(max(problem.free.n, 1)))
    if given is not None:
        size = require_integer(
            "population", given, low=2, high=COUNT, accepted="None, or an integer >= 2"
        )
    drives = f"population = {shown(size)} at {len(problem.x)} waypoints"
    require_stations(drives, 2.0 * size * len(problem.x))  # rounded up to a power of two
    require_waypoint_matrices(problem, "cma", square=COVARIANCE)
    return size


class _Samples:
    """Objective and penalty of points in the unit box of the angles that are free.

    first: the start there. best: the best point that misses nothing, or else the start.
    """

    def __init__(self, near: Near, x: np.ndarray, penalty: float):
        problem = near.problem
        self.problem, self.penalty, self.count = problem, penalty, 1
        self._shared = without_criterion(problem)
        self.low, high = problem.free.bounds
        self.range = high - self.low
        self.first = np.clip((problem.free.reduce(x) - self.low) / self.range, 0, 1)
        self.scale = near.scale(near(x))
        self.best = x
        self.best_value = near.value(near(x)) if problem.is_feasible(x) else np.inf

    def values(self, points: Float[np.ndarray, "B free"]) -> np.ndarray:
        """What cma minimises, [B]; infinite where the vehicle has no pose."""
        X = self.problem.free.expand(self.low + np.clip(points, 0, 1) * self.range)
        value, missed = self._evaluate(X)
        self.count += len(X)
        met = np.where(missed > FLOOR, np.inf, value)
        i = int(np.argmin(met))
        if met[i] < self.best_value:
            self.best, self.best_value = X[i], float(met[i])
        priced = value / self.scale + self.penalty * np.where(missed > FLOOR, missed, 0.0)
        return np.where(np.isfinite(priced), priced, np.inf)

    def _evaluate(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Objective and shortfall [B], padded to a power of two so that few sizes are compiled."""
        more = (1 << (len(X) - 1).bit_length()) - len(X)
        padded = np.concatenate([X, np.repeat(X[-1:], more, axis=0)])
        angles = padded.reshape(len(padded), -1, 2)
        with jax.enable_x64(True):
            found = traced.stations(self._shared, angles)
            value = traced.values(self.problem.posture.criterion, found)
            missed = shortfall(self._shared, found, angles)
        return np.asarray(value)[: len(X)], np.asarray(missed)[: len(X)]


@jax.jit
def shortfall(posture: Posture, found: Station, angles: Float[Array, "B K 2"]) -> Float[Array, "B"]:
    """The scaled margins that a batch of drives misses, summed; found: their stations [B, K]."""

    def of_one(one, pairs):
        margins = posture.constraints(one, pairs).values()
        return jnp.sum(jnp.stack([jnp.sum(jnp.maximum(-of, 0)) for of in margins]))

    return jax.vmap(of_one)(found, angles)


def _package():
    try:
        import cma
    except ImportError as error:
        raise ImportError("the method 'cma' needs cma: pip install 'stickslip[optim]'") from error
    return cma
