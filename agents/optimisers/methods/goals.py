"""Methods for several goals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import minimize

from stickslip.agents.optimisers.methods.evolution import from_pymoo
from stickslip.agents.optimisers.methods.starts import starts
from stickslip.optim.instances.record import BudgetSpent

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.instances.objective import Objective

POINTS, SHARES = 40, np.linspace(1, 0, 9)


def pymoo_nsga2(objective: Objective, seed: int) -> None:
    """NSGA-II of pymoo."""
    from_pymoo(objective, seed, "pymoo.algorithms.moo.nsga2", "NSGA2", POINTS)


def slsqp_weights(objective: Objective, seed: int) -> None:
    """SLSQP on weighted sums of two goals, each in parts of its size at the start.

    Every weight begins where the one before ended and gets an equal part of the budget; with
    budget left it begins anew from another start.
    """
    part = max(1, (objective.budget or 9 * 200) // len(SHARES))
    for start in starts(objective, seed):
        scale, x = np.maximum(np.abs(objective(start)), 1e-12), start
        scale = np.where(np.isfinite(scale), scale, 1.0)
        for share in SHARES:
            x = _weighted(objective, x, np.array([share, 1 - share]) / scale, part)


class _PartSpentError(Exception):
    """A weight had its part of the budget."""


def _weighted(
    objective: Objective, start: Float[np.ndarray, "n"], weights: np.ndarray, part: int
) -> np.ndarray:
    """Where SLSQP ends, or what it saw last within its part."""
    last, until = start, objective.record.evaluations + part

    def value(x: np.ndarray) -> float:
        nonlocal last
        if objective.record.evaluations >= until:
            raise _PartSpentError
        last = np.array(x)
        return float(weights @ objective(x))

    def slope(x: np.ndarray) -> np.ndarray:
        return weights @ np.array([objective.gradient(x, goal) for goal in range(len(weights))])

    limits = {"type": "ineq", "fun": objective.constraints, "jac": objective.jacobian}
    try:
        found = minimize(
            value,
            start,
            jac=slope,
            bounds=list(zip(*objective.bounds, strict=True)),
            constraints=limits if objective.m else (),
            method="SLSQP",
            options={"maxiter": 200},
        )
    except _PartSpentError:
        return last
    except BudgetSpent:
        raise
    return found.x
