"""Result of a method, with its bound and status; outcomes of cvxpy's solver by the same names."""

from __future__ import annotations

import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from stickslip.dynamics.pytrees import read_only

if TYPE_CHECKING:
    import cvxpy as cp
    from jaxtyping import Float


class OptimStatus(Enum):
    """Outcome of a method; each value describes itself."""

    OPTIMAL = "proved optimal to the method's tolerance"
    FEASIBLE = "meets every constraint; not proved optimal"
    LIMIT = "stopped at a limit of iterations or time; the best point so far"
    INACCURATE = "the numbers do not agree to the accuracy that was asked for"
    VIOLATED = "a point that breaks a constraint: see residuals"
    INFEASIBLE = "proved: no point meets every constraint"
    FAILED = "no usable answer"

    @property
    def solved(self) -> bool:
        """True if the point meets every constraint and the method ended as it should."""
        return self in (OptimStatus.OPTIMAL, OptimStatus.FEASIBLE)


HOPELESS = (OptimStatus.INFEASIBLE, OptimStatus.FAILED)
"""Those that stay as they are where a point breaks a constraint; all others become VIOLATED."""


@dataclass(frozen=True)
class Evaluation:
    """Evaluation of a point.

    value: the objective's, infinite where there is none, never NaN. margins: `constraints` there
    [m], scaled to about 1. feasible: within FEASIBLE. residuals: by how much each kind of
    constraint is missed at worst, in its own unit, 0 where it is met.
    """

    value: float
    margins: Float[np.ndarray, "m"]
    feasible: bool
    residuals: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Result:
    """The outcome of `solve`; a problem's `result_kind` may say more.

    x: the decision vector [n], None where there is none. value: the problem's own objective at x,
    evaluated anew; infinite without x. lower_bound: no feasible point of the problem has a lower
    value; at most `value`; None: nothing is proved. feasible, residuals: of x, by the problem
    (Problem.residuals). evaluations: how many were made, of what the method says in its own
    docstring. seconds: all of it, compilation too. message: for a person. details: the method's
    own findings.
    """

    method: str
    status: OptimStatus
    x: Float[np.ndarray, "n"] | None
    value: float
    lower_bound: float | None = None
    feasible: bool = False
    residuals: Mapping[str, float] = field(default_factory=dict)
    evaluations: int = 0
    seconds: float = 0.0
    message: str = ""
    details: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self):
        if self.x is not None:
            object.__setattr__(self, "x", read_only(self.x))

    @property
    def gap(self) -> float:
        """Gap between value and lower bound; infinite if nothing is proved."""
        return np.inf if self.lower_bound is None else self.value - self.lower_bound

    @property
    def status_in_words(self) -> str:
        return f"{self.status.name}: {self.status.value}"

    @classmethod
    def of(
        cls,
        x: Float[np.ndarray, "n"],
        evaluation: Evaluation,
        *,
        method: str,
        status: OptimStatus,
        began: float,
        **others: Any,
    ) -> Self:
        """The result at a point that was evaluated: see Problem.result."""
        return cls(
            method=method,
            status=status if evaluation.feasible or status in HOPELESS else OptimStatus.VIOLATED,
            x=x,
            value=evaluation.value,
            feasible=evaluation.feasible,
            residuals=evaluation.residuals,
            seconds=time.perf_counter() - began,
            **others,
        )

    @classmethod
    def without_point(
        cls, *, method: str, status: OptimStatus, began: float, message: str, **others: Any
    ) -> Self:
        """The result of a method that found no point."""
        seconds = time.perf_counter() - began
        return cls(method, status, None, np.inf, seconds=seconds, message=message, **others)


STATUSES = {
    "optimal": OptimStatus.OPTIMAL,
    "optimal_inaccurate": OptimStatus.INACCURATE,
    "user_limit": OptimStatus.LIMIT,
    "infeasible": OptimStatus.INFEASIBLE,
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
        return self.status in ANSWERED


def solve_quietly(problem: cp.Problem, *, bounded: bool = False, **settings: float) -> Ended:
    """Solve with Clarabel, and name the outcome; FAILED where the solver gave up.

    bounded: the objective has a floor, so that "infeasible or unbounded" means INFEASIBLE.
    settings: the solver's own. No solve leaves anything to the next: a solver that is kept scales
    other numbers as it scaled the first, and may then fail. cvxpy's warning that a solution may be
    inaccurate is left out: the status says it.
    """
    import cvxpy as cp

    solver = "CLARABEL"
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Solution may be inaccurate")
        try:
            problem.solve(solver=solver, warm_start=False, **settings)
        except cp.SolverError as error:
            return Ended(OptimStatus.FAILED, f"{solver}: {error}")
    message = f"{solver} ended with status {problem.status}"
    if bounded and problem.status == "infeasible_or_unbounded":
        return Ended(OptimStatus.INFEASIBLE, message)
    return Ended(STATUSES.get(problem.status, OptimStatus.FAILED), message)
