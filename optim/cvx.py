"""The one door to cvxpy's solvers: quiet, and with named outcomes."""

from __future__ import annotations

import warnings
from typing import NamedTuple

import cvxpy as cp
from cvxpy.settings import INFEASIBLE_OR_UNBOUNDED

from stickslip.optim.result import OptimStatus

STATUSES = {
    cp.OPTIMAL: OptimStatus.OPTIMAL,
    cp.OPTIMAL_INACCURATE: OptimStatus.INACCURATE,
    cp.USER_LIMIT: OptimStatus.LIMIT,
    cp.INFEASIBLE: OptimStatus.INFEASIBLE,
}
"""cvxpy's statuses as named outcomes, whatever the objective; all others are FAILED. Inaccurate is
never passed off as optimal, nor as a proof that there is no point."""

ANSWERED = (OptimStatus.OPTIMAL, OptimStatus.INACCURATE, OptimStatus.LIMIT)
"""Outcomes with a point to look at."""


class Ended(NamedTuple):
    """Outcome of a solver, with the solver's or cvxpy's message."""

    status: OptimStatus
    message: str

    @property
    def answered(self) -> bool:
        """True if there is a point to look at."""
        return self.status in ANSWERED


def solve_quietly(
    problem: cp.Problem, solver: str, *, bounded: bool = False, **settings: float
) -> Ended:
    """Solve, and name the outcome; FAILED where the solver gave up.

    bounded: the objective has a floor, so that "infeasible or unbounded" means INFEASIBLE.
    settings: the solver's own. No solve leaves anything to the next: a solver that is kept scales
    other numbers as it scaled the first, and may then fail. cvxpy's warning that a solution may be
    inaccurate is left out: the status says it.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Solution may be inaccurate")
        try:
            problem.solve(solver=solver, warm_start=False, **settings)
        except cp.SolverError as error:
            return Ended(OptimStatus.FAILED, f"{solver}: {error}")
    message = f"{solver} ended with status {problem.status}"
    if bounded and problem.status == INFEASIBLE_OR_UNBOUNDED:
        return Ended(OptimStatus.INFEASIBLE, message)
    return Ended(STATUSES.get(problem.status, OptimStatus.FAILED), message)
