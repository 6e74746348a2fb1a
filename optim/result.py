"""What a method found, and how good it is known to be."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.optim.finer import evaluate_finer

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.problem import PostureProblem


class OptimStatus(Enum):
    """Outcome of a method; each value says what it means."""

    OPTIMAL = "proved optimal, for what bound_of says"
    FEASIBLE = "meets every constraint; not proved optimal"
    LIMIT = "stopped at a limit of iterations or time; the best point so far"
    INACCURATE = "the numbers do not agree to the accuracy that was asked for"
    VIOLATED = "a point that breaks a constraint: see residuals"
    INFEASIBLE = "proved: no point meets every constraint, for what bound_of says"
    FAILED = "no usable answer"

    @property
    def solved(self) -> bool:
        """Whether the point meets every constraint and the method ended as it should."""
        return self in (OptimStatus.OPTIMAL, OptimStatus.FEASIBLE)


@dataclass(frozen=True)
class Result:
    """The outcome of `solve`.

    x: the decision vector [2K], None where there is none. value: the problem's own objective at x,
    evaluated anew; infinite without x. lower_bound: no point of what `bound_of` names is below it;
    None: nothing is proved. feasible, residuals: of x, by the problem (PostureProblem.residuals).
    evaluations: how many drives or stations were evaluated, as the method says in its own
    docstring. fine_value, fine_feasible, fine_residuals: of the same drive on waypoints
    `fine_spacing` [m] apart, ten times closer, the legs moving evenly from one to the next
    (`evaluate_finer`): what the problem, and so every bound, knows nothing of. seconds: all of it,
    compilation too. message: for a person. details: the method's own findings.
    """

    method: str
    status: OptimStatus
    x: Float[np.ndarray, "n"] | None
    value: float
    lower_bound: float | None = None
    bound_of: str = ""
    feasible: bool = False
    residuals: Mapping[str, float] = field(default_factory=dict)
    fine_value: float = np.inf
    fine_spacing: float = np.nan
    fine_feasible: bool = False
    fine_residuals: Mapping[str, float] = field(default_factory=dict)
    evaluations: int = 0
    seconds: float = 0.0
    message: str = ""
    details: Mapping[str, Any] = field(default_factory=dict)

    @property
    def leg_angles(self) -> Float[np.ndarray, "K 2"] | None:
        """x as pairs, rear and front leg at each waypoint [rad]."""
        return None if self.x is None else self.x.reshape(-1, 2)

    @property
    def gap(self) -> float:
        """How far the value may be above the best of what bound_of names; infinite if unknown.

        Below 0 where the drive is none of these, and better: one off the grid.
        """
        return np.inf if self.lower_bound is None else self.value - self.lower_bound

    @property
    def discretisation(self) -> float:
        """How far fine_value lies from the value, relative to it; infinite where there is none.

        Where it is not small, the waypoints are too far apart.
        """
        if not (np.isfinite(self.value) and np.isfinite(self.fine_value)):
            return np.inf
        off = self.fine_value - self.value
        return off / max(abs(self.value), np.finfo(float).tiny) if off else 0.0

    @classmethod
    def at(
        cls,
        problem: PostureProblem,
        x: Float[np.ndarray, "n"],
        *,
        method: str,
        status: OptimStatus,
        began: float,
        **others: Any,
    ) -> Result:
        """The result at a point: value, residuals and feasibility are the problem's own.

        A status that promises feasibility becomes VIOLATED where the point breaks a constraint.
        began: time.perf_counter() when the method began. others: the remaining fields.
        """
        x = np.array(x, dtype=float).reshape(-1)
        feasible = problem.is_feasible(x)
        fine = evaluate_finer(problem, x)
        return cls(
            method=method,
            status=status if feasible or not status.solved else OptimStatus.VIOLATED,
            x=x,
            value=problem.objective(x),
            feasible=feasible,
            residuals=problem.residuals(x),
            fine_value=fine.value,
            fine_spacing=fine.spacing,
            fine_feasible=fine.feasible,
            fine_residuals=fine.residuals,
            seconds=time.perf_counter() - began,
            **others,
        )

    @classmethod
    def without_point(
        cls, *, method: str, status: OptimStatus, began: float, message: str, **others: Any
    ) -> Result:
        """The result of a method that found no point."""
        seconds = time.perf_counter() - began
        return cls(method, status, None, np.inf, seconds=seconds, message=message, **others)
