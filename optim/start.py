"""Starting point of a gradient or sampling method, for any problem."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.optim.options import as_floats
from stickslip.optim.result import OptimStatus, Result

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.problem import Problem


def begin(
    problem: Problem[Any], method: str, start: Any, began: float
) -> tuple[Float[np.ndarray, "n"], float] | Result:
    """A point within the bounds and its value: `start`, or for None the bounds' middle. Or the
    result, where there is no value at it, or no choice. ValueError without finite bounds."""
    low, high = problem.bounds
    if not (np.all(np.isfinite(low)) and np.all(np.isfinite(high))):
        raise ValueError("bounds are not finite; accepted by methods that search: finite bounds")
    if start is None:
        x = (low + high) / 2
    else:
        accepted = f"None, or {problem.n} finite numbers"
        x = as_floats("start", start, accepted)
        if x.shape != (problem.n,):
            raise ValueError(f"start has shape {x.shape}; accepted: {accepted}")
        x = np.clip(x, low, high)
    value = problem.objective(x)
    common: dict[str, Any] = {"method": method, "began": began, "evaluations": 1}
    if problem.free.n == 0:
        message = f"every number is given{shortcomings(problem, x)}"
        return problem.result(x, status=OptimStatus.FEASIBLE, message=message, **common)
    if not np.isfinite(value):
        message = f"where it begins there is no value{shortcomings(problem, x)}"
        return problem.result(x, status=OptimStatus.FAILED, message=message, **common)
    return x, value


def shortcomings(problem: Problem[Any], x: Float[np.ndarray, "n"]) -> str:
    """Text of the constraints that a point violates and by how much; empty where it meets all."""
    if problem.is_feasible(x):
        return ""
    missed = {name: by for name, by in problem.residuals(x).items() if by > 0}
    return "; misses " + ", ".join(f"{name} by {by:.4g}" for name, by in missed.items())
