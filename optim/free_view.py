"""A posture problem without the angles that have no choice, for optimisers that refuse those."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.waypoints import as_floats

if TYPE_CHECKING:
    from jaxtyping import Bool, Float

    from stickslip.optim.problem import PostureProblem


@dataclass(frozen=True)
class FreeProblem:
    """The same problem in the angles that its bounds leave free, as plain arrays [n].

    Left out are those whose bounds are equal: given ends, and all where the legs' range is one
    angle (then n is 0). Objective and constraints, in value and number, are the problem's at
    `expand(x)`.
    """

    problem: PostureProblem

    @cached_property
    def which(self) -> Bool[np.ndarray, "2K"]:
        """Which of the problem's angles are free."""
        low, high = self.problem.bounds
        return low < high

    @property
    def n(self) -> int:
        """How many are."""
        return int(np.sum(self.which))

    @property
    def bounds(self) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        """Their least and greatest values [rad]."""
        low, high = self.problem.bounds
        return low[self.which], high[self.which]

    def expand(self, x: Float[np.ndarray, "... n"]) -> Float[np.ndarray, "... 2K"]:
        """The problem's decision vector, or a batch; ValueError for a wrong length."""
        free = (
            np.asarray(x, dtype=float)
            if self.n == 0
            else as_floats("x", x, "the free angles [rad]")
        )
        if free.ndim == 0 or free.shape[-1] != self.n:
            raise ValueError(
                f"x has shape {free.shape}; accepted: (..., {self.n}), the free angles"
            )
        whole = np.broadcast_to(self.problem.bounds[0], (*free.shape[:-1], self.problem.n)).copy()
        whole[..., self.which] = free
        return whole

    def reduce(self, x: Float[np.ndarray, "... 2K"]) -> Float[np.ndarray, "... n"]:
        """The free angles of a decision vector, or of a batch; ValueError for a wrong length."""
        whole = as_floats("x", x, "all angles [rad]")
        if whole.ndim == 0 or whole.shape[-1] != self.problem.n:
            raise ValueError(f"x has shape {whole.shape}; accepted: (..., {self.problem.n})")
        return whole[..., self.which]

    def objective(self, x: Float[np.ndarray, "n"]) -> float:
        """The criterion's value: see PostureProblem.objective."""
        return self.problem.objective(self.expand(x))

    def gradient(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """Its slope [unit/rad]."""
        return self.problem.gradient(self.expand(x))[self.which]

    def objectives(self, X: Float[np.ndarray, "B n"]) -> Float[np.ndarray, "B"]:
        """The values of a batch."""
        return self.problem.objectives(self.expand(X))

    def constraints(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "m"]:
        """All of the problem's, satisfied where >= 0; those of given ends alone are constant."""
        return self.problem.constraints(self.expand(x))

    def jacobian(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "m n"]:
        """Slopes of `constraints` [1/rad]."""
        return self.problem.jacobian(self.expand(x))[:, self.which]

    def is_feasible(self, x: Float[np.ndarray, "n"], tolerance: float | None = None) -> bool:
        """Whether the point meets every constraint: see PostureProblem.is_feasible."""
        given = () if tolerance is None else (tolerance,)
        return self.problem.is_feasible(self.expand(x), *given)
