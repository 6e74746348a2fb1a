"""Evolution (optim/methods.py) for the UGV's leg angles, from where a method of the grid ends."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from stickslip.dynamics.checks import shown
from stickslip.optim.methods import evolution, evolve, package, shortcomings
from stickslip.optim.posture.local.linearise import begin
from stickslip.optim.posture.result import PostureResult
from stickslip.optim.posture.waypoints import (
    COVARIANCE,
    require_stations,
    require_waypoint_matrices,
)

if TYPE_CHECKING:
    from stickslip.optim.posture.problem import PostureProblem


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
    found = evolve(problem, search, x, near.value(at), near.scale(at), progress)
    return problem.result(
        found.x,
        method="cma",
        began=began,
        status=found.status,
        evaluations=found.evaluations,
        message=note + found.message + shortcomings(problem, found.x),
        details={"stop": found.stop, "seed": search.seed},
    )
