"""Solve a gait program and certify its answer; the least friction demand; proofs of infeasibility.

Where all weights of the objective are 0, a bound above 0 (`certificate.py`) is a contradiction: a
gait within the limits would have the value 0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.gait.convex.certificate import Multipliers, Polygons, every_bound, grid_bound
from stickslip.optim.gait.convex.limits import FRICTION
from stickslip.optim.gait.convex.program import Solved, program_of
from stickslip.optim.gait.gait import Certificate
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.optim.gait.convex.grid_problem import GridProblem
    from stickslip.optim.gait.gait import Gait

SLOW = 0.1
"""If the greatest b is less than this of its unit, the unit is reduced and all is solved
again: the solver's accuracy is that of the largest numbers."""
ROUNDS = 30
NO_DEMAND = 1e-9
"""A friction demand below this is none."""
SHORTFALLS = tuple(10.0**-k for k in range(9, 0, -1))
HALVINGS = 4


@dataclass(frozen=True)
class Answer:
    """The gait on the grid, its certificate, a bound on every gait (None: none proved), how the
    solver ended and how often it ran. problem: what was solved. relaxed: the limit that the
    program minimised the excess of, if it did."""

    gait: Gait
    certificate: Certificate
    every: float | None
    solved: Solved
    problem: GridProblem
    solves: int = 1
    relaxed: str = ""


def answered(problem: GridProblem, solves: int = 1, *, every: bool = True) -> Answer | Solved:
    """Solve and certify; the bare outcome without a point. every: bound every gait, too."""
    numbers = problem.numbers()
    solved = program_of(problem.structure).solve(numbers)
    if solved.a is None or solved.b is None or solved.duals is None:
        return solved
    units, scale = problem.units, problem.scale
    if solves < 3 and np.max(solved.b) < SLOW:
        rate = units.rate * float(np.sqrt(max(np.max(solved.b), 1e-6)))
        return answered(replace(problem, rate_unit=rate), solves + 1, every=every)
    gait = problem.gait_of(solved)
    value = problem.goal.of(gait.spent_on_grid)
    multipliers, at = Multipliers.of(solved.duals), (solved.a, gait.b / units.b)
    bound = grid_bound(problem, problem.sample(inside=False), numbers, multipliers, at) * scale
    proved = None
    if every:
        inside = problem.sample(inside=True)
        proved = max(every_bound(problem, inside, numbers, multipliers) * scale, 0.0)
    certificate = certificate_of(problem, gait, solved, value, max(bound, 0.0))
    return Answer(gait, certificate, proved, solved, problem, solves)


def certificate_of(
    problem: GridProblem, gait: Gait, solved: Solved, value: float, bound: float
) -> Certificate:
    """The certificate of a value and a bound: with violation, sign and complementarity."""
    excess = problem.rows.scaled_excess(gait.a, gait.b)
    violation = max(float(np.max(excess)), 0.0)
    if solved.duals is None:
        return Certificate(value, bound, violation, -np.inf, np.inf)
    multipliers = solved.duals.rows
    total = max(1.0, float(np.sum(np.abs(multipliers))))
    products = float(np.max(np.abs(multipliers * -excess.reshape(multipliers.shape)))) / total
    sign = min(float(np.min(multipliers)) / total, 0.0)
    return Certificate(value, bound, violation, sign, products)


def least_demand(problem: GridProblem, *, every: bool = True) -> Answer | Solved:
    """The least |friction| / normal force, by Dinkelbach's method: at the demand t reached so far
    the gait with the least excess of |friction| over t N has a lower one, and these fall faster
    than geometrically to the least.

    The bound is the greatest t' tried for which the last multipliers prove that no gait gets by
    with t'. every: look for one on every gait, too.
    """
    demand, best, solves = 1.0, None, 0
    solved = Solved(OptimStatus.FAILED, "nothing was solved")
    for _ in range(ROUNDS):
        at = _with_friction(problem, demand)
        solved = relaxed(at, FRICTION)
        solves += 1
        if solved.a is None or solved.b is None:
            break
        gait = at.gait_of(solved)
        lower = gait.friction_at_nodes
        if best is not None and lower >= demand * (1 - 1e-9):
            break
        best, demand = (gait, solved, at), lower
        if demand < NO_DEMAND:
            break
    if best is None:
        return solved
    gait, solved, at = best
    bounds = [
        _greatest_proved(
            demand, lambda t, whole=whole: excluded(_with_friction(problem, t), solved, whole)
        )
        for whole in (False, True)[: 1 + every]
    ]
    certificate = certificate_of(at, gait, solved, demand, bounds[0])
    return Answer(gait, certificate, bounds[1] if every else None, solved, at, solves, FRICTION)


def relaxed(problem: GridProblem, limit: str) -> Solved:
    """Least necessary violation r of a limit, in its unit of size, and the solution."""
    numbers = replace(problem.numbers(relaxed=limit), weights={})
    return program_of(problem.structure._replace(terms=())).solve(numbers)


def excluded(problem: GridProblem, solved: Solved, every: bool) -> bool:
    """True if multipliers prove that no gait keeps to the problem's limits: no gait of the grid,
    or no gait whatever. solved: of `relaxed`, of this problem or one that differs in its rows."""
    if solved.duals is None or solved.a is None or solved.b is None:
        return False
    numbers = replace(problem.numbers(), weights={})
    sample, multipliers = problem.sample(inside=every), Multipliers.of(solved.duals)
    if every:
        return every_bound(problem, sample, numbers, multipliers) > 0
    return grid_bound(problem, sample, numbers, multipliers, (solved.a, solved.b)) > 0


def nothing_left(problem: GridProblem) -> bool:
    """True if the limits leave no acceleration and no rate at all at some node."""
    polygons = Polygons.of(problem.sample(inside=False))
    return bool(np.any(polygons.low > polygons.high))


def _with_friction(problem: GridProblem, demand: float) -> GridProblem:
    return problem.limited(mu=np.full(problem.grid.steps, demand))


def _greatest_proved(demand: float, proved: Callable[[float], bool]) -> float:
    """About the greatest demand that is proved to be too low."""
    before = 0.0
    for shortfall in SHORTFALLS:
        if proved(demand * (1 - shortfall)):
            low, high = before, shortfall
            for _ in range(HALVINGS if before else 0):
                middle = float(np.sqrt(low * high))
                low, high = (low, middle) if proved(demand * (1 - middle)) else (middle, high)
            return demand * (1 - high)
        before = shortfall
    return 0.0
