"""A periodic gait of few numbers, whose limits are those of a finer grid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.problem import Problem
from stickslip.optim.result import Result

if TYPE_CHECKING:
    from collections.abc import Callable

    import cvxpy as cp
    from jaxtyping import Float

    from stickslip.optim.gait.problem import GaitProblem
    from stickslip.optim.problem import Structure
    from stickslip.optim.result import Evaluation


@dataclass(frozen=True, eq=False)
class Interpolated(Problem[Result]):
    """A periodic step with a crank acceleration at both ends of `cells` cells, straight in between.

    fine: the problem whose cells divide these evenly. Its objective and limits are those of the
    step, so that no limit is missed between the few nodes. Decision vector as GaitProblem's.
    """

    fine: GaitProblem
    cells: int

    @property
    def structure(self) -> frozenset[Structure]:
        """See GaitProblem."""
        return self.fine.structure

    @property
    def n(self) -> int:
        """See GaitProblem."""
        return self.cells + 2

    @property
    def bounds(self) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        """See GaitProblem."""
        low, high = self.fine.bounds
        return low[self.kept], high[self.kept]

    @cached_property
    def kept(self) -> np.ndarray:
        """Indices of the decision vector in that of `fine` [n]."""
        return np.r_[0, 1 : self.fine.n : self.fine.cells // self.cells]

    @cached_property
    def matrix(self) -> Float[np.ndarray, "fine n"]:
        """Matrix from the decision vector to that of `fine`."""
        found = np.zeros((self.fine.n, self.n))
        found[0, 0] = 1.0
        for column, one in enumerate(np.eye(self.cells + 1), start=1):
            found[1:, column] = np.interp(np.arange(1, self.fine.n), self.kept[1:], one)
        return found

    def evaluate(self, x: Float[np.ndarray, "n"]) -> Evaluation:
        """See GaitProblem."""
        return self.fine.evaluate(self.matrix @ self.batch([x])[0])

    def gradient(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """See GaitProblem."""
        return self.fine.gradient(self.matrix @ self.batch([x])[0]) @ self.matrix

    def jacobian(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "m n"]:
        """See GaitProblem."""
        return self.fine.jacobian(self.matrix @ self.batch([x])[0]) @ self.matrix

    def in_cvxpy(self) -> tuple[cp.Problem, Callable[[], Float[np.ndarray, "n"]]]:
        """See GaitProblem."""
        import cvxpy as cp

        problem, found = self.fine.in_cvxpy()
        (a,) = (one for one in problem.variables() if one.name() == "a")
        inside = np.setdiff1d(np.arange(1, self.fine.cells), self.kept - 1)
        straight = a[inside - 1] - 2 * a[inside] + a[inside + 1] == 0
        whole = cp.Problem(problem.objective, [*problem.constraints, straight])
        return whole, lambda: found()[self.kept]
