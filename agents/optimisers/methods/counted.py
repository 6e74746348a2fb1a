"""An objective as a Problem, so that the methods of `solve` are counted as any other's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.problem import Problem, Structure, shortfall
from stickslip.optim.result import Evaluation, Result

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.instances.objective import Objective


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
