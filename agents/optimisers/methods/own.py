"""The methods of stickslip.optim: those for a problem's structure, and those for all problems."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.optimisers.methods.local import restarted
from stickslip.optim.methods import solve_cma, solve_gradient
from stickslip.optim.problem import Problem, Structure, shortfall
from stickslip.optim.result import Evaluation, Result
from stickslip.optim.solving import solve

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.instances.objective import Objective

MANY = 10**9


def dp(objective: Objective, seed: int) -> None:
    """The grid's best drive, without polishing; one evaluation, of what it found."""
    _inside(objective, "dp")


def scp(objective: Objective, seed: int) -> None:
    """Convex programming from there; one evaluation, of what it found."""
    _inside(objective, "scp")


def _inside(objective: Objective, method: str) -> None:
    found = solve(objective.problems[0], method, polish=False)
    if found.x is None:
        raise RuntimeError(found.message or found.status.value)
    objective(objective.free[0].reduce(found.x))


def conic(objective: Objective, seed: int) -> None:
    """A convex program by cvxpy; one evaluation, of what it found."""
    program, found = objective.problems[0].in_cvxpy()
    program.solve(solver="CLARABEL")
    objective(np.clip(objective.free[0].reduce(found()), *objective.bounds))


def gradient(objective: Objective, seed: int) -> None:
    """`solve(problem, "gradient")` from one start after the other."""
    problem = CountedProblem(objective)
    restarted(
        objective, seed, lambda start, _: solve_gradient(problem, start=start, iterations=1000)
    )


def cma(objective: Objective, seed: int) -> None:
    """`solve(problem, "cma")` from one start after the other."""
    problem = CountedProblem(objective)

    def search(start: np.ndarray, number: int) -> None:
        own = 10_000 * seed + number
        solve_cma(problem, start=start, seed=own, evaluations=MANY, sigma=0.2)

    restarted(objective, seed, search)


@dataclass(frozen=True, eq=False)
class CountedProblem(Problem[Result]):
    """The free numbers of an objective with one goal; every evaluation is the objective's."""

    counted: Objective

    @property
    def structure(self) -> frozenset[Structure]:
        """Slopes, where the objective has them."""
        return frozenset({Structure.SMOOTH} if self.counted.has_slopes else ())

    @property
    def n(self) -> int:
        """See Problem."""
        return self.counted.n

    @property
    def bounds(self) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        """See Problem."""
        return self.counted.bounds

    def evaluate(self, x: Float[np.ndarray, "n"]) -> Evaluation:
        """See Problem."""
        value, margins = self.counted(x), self.counted.constraints(x)
        missed = float(max(0.0, -np.min(margins, initial=0.0)))
        feasible = self.meets(np.asarray(x, float), margins)
        return Evaluation(value, margins, feasible, {"margins": missed})

    def sample(
        self, X: Float[np.ndarray, "B n"]
    ) -> tuple[Float[np.ndarray, "B"], Float[np.ndarray, "B"]]:
        """See Problem."""
        values, margins = self.counted.batch_with_constraints(X)
        return values, shortfall(margins)

    def gradient(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """See Problem."""
        return self.counted.gradient(x)

    def jacobian(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "m n"]:
        """See Problem."""
        return self.counted.jacobian(x)
