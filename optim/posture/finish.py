"""The result of a method at a drive, evaluated between its waypoints, too."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.optim.posture.finer import evaluate_finer

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.posture.problem import PostureProblem
    from stickslip.optim.posture.result import PostureResult


def result_at(problem: PostureProblem, x: Float[np.ndarray, "n"], **others: Any) -> PostureResult:
    """See Problem.result."""
    x = np.array(x, dtype=float).reshape(-1)
    fine = evaluate_finer(problem, x)
    return problem.result(
        x,
        fine_value=fine.value,
        fine_spacing=fine.spacing,
        fine_feasible=fine.feasible,
        fine_residuals=fine.residuals,
        **others,
    )
