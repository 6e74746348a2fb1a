"""The biped's gaits as convex programs: a crank acceleration at every node of a step."""

from __future__ import annotations

import numpy as np

from stickslip.dynamics.biped import BipedParams
from stickslip.optim.gait.problem import GaitProblem

TORQUE_LIMIT = 4.0


def gait_problem(objective: str, numbers: int, **limits: float) -> GaitProblem:
    """The best periodic step of the reference robot in so many numbers, with a motor of
    TORQUE_LIMIT. limits: mu, mean_rate."""
    return GaitProblem.periodic(
        BipedParams.from_bars(dtype=np.float32),
        objective,
        mu=limits.get("mu"),
        mean_rate=limits.get("mean_rate"),
        torque_limit=TORQUE_LIMIT,
        steps=numbers - 2,
    )


def gait_goals(
    objectives: tuple[str, ...], numbers: int, **limits: float
) -> tuple[GaitProblem, ...]:
    """The same step by several objectives."""
    return tuple(gait_problem(one, numbers, **limits) for one in objectives)
