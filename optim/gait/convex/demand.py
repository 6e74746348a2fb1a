"""The least friction demand of a gait: a quotient, the largest |friction| / normal force."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.gait.convex.answer import Answer, conditions
from stickslip.optim.gait.convex.limits import FRICTION
from stickslip.optim.gait.convex.program import Solved
from stickslip.optim.gait.proof.impossible import excluded, relaxed
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.optim.gait.convex.instance import Instance

ROUNDS = 30
NONE_AT_ALL = 1e-9
"""A friction demand below this is none."""
SHORTFALLS = tuple(10.0**-k for k in range(9, 0, -1))
HALVINGS = 4


def least_demand(instance: Instance, *, every: bool = True) -> Answer | Solved:
    """Dinkelbach's method: at the demand t reached so far the gait with the least excess of
    |friction| over t N has a lower one, and these fall faster than geometrically to the least.

    The bound is the greatest t' tried for which the last multipliers prove that no gait gets by
    with t'. every: look for one on every gait, too.
    """
    demand, best, solves = 1.0, None, 0
    solved = Solved(OptimStatus.FAILED, "nothing was solved")
    for _ in range(ROUNDS):
        at = _with(instance, demand)
        _, solved = relaxed(at, FRICTION)
        solves += 1
        if solved.a is None or solved.b is None:
            break
        gait = at.gait_of(solved)
        lower = gait.friction_at_nodes
        if best is not None and lower >= demand * (1 - 1e-9):
            break
        best, demand = (gait, solved, at), lower
        if demand < NONE_AT_ALL:
            break
    if best is None:
        return solved
    gait, solved, at = best
    bounds = [
        _bound(demand, lambda t, whole=whole: excluded(_with(instance, t), solved, whole))
        for whole in (False, True)[: 1 + every]
    ]
    certificate = conditions(at, gait, solved, demand, bounds[0])
    return Answer(gait, certificate, bounds[1] if every else None, solved, at, solves, FRICTION)


def _with(instance: Instance, demand: float) -> Instance:
    return instance.use(mu=np.full(instance.grid.steps, demand))


def _bound(demand: float, proved: Callable[[float], bool]) -> float:
    """About the greatest demand that is proved to be too low."""
    before = 0.0
    for shortfall in SHORTFALLS:
        if proved(demand * (1 - shortfall)):
            low, high = before, shortfall
            for _ in range(HALVINGS if before else 0):
                middle = float(np.sqrt(low * high))
                low, high = (low, middle) if proved(demand * (1 - middle)) else (middle, high)
            return demand * (1 - high)
        before = shortfall
    return 0.0
