"""The most that steady walking without slip earns: a bound on the biped's reward from its duals.

A step of a walk that repeats itself takes the time t and the energy E over the length L. The reward
is tracking (1 - |v - v*| / v*), at least -1, less price E / t. No v earns more tracking than
s v / v* + 1 - s, whatever the share s from 0 to 1, and v averages to L / t. With t* = L / v* the
reward of a second is therefore at most

    tracking (s t* / t + 1 - s) - price E / t  <=  c = tracking + beta - V(beta) / t*

for any beta >= 0 with V(beta) <= price t* E + beta t in every gait, taking s = V / (tracking t*).
V comes from the convex program's multipliers (certificate.py), for every gait, whatever the grid.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from stickslip.optim.gait.problem import GaitProblem
from stickslip.optim.gait.profile import robot_of
from stickslip.optim.problem import require_scalar, solve

if TYPE_CHECKING:
    from stickslip.dynamics.biped import BipedParams

CLOSE = 1e-4
"""Tolerance of the search, in parts of the range of beta."""
MOST = 40
"""Programs that are solved, at most."""


class SteadyBound(NamedTuple):
    """Bound of the reward in every gait [1/s], and mean rate of the gait that comes nearest
    [rad/s]."""

    value: float
    mean_rate: float


def bound_steady_reward(
    params: BipedParams,
    mean_rate: float,
    *,
    mu: float,
    torque_limit: float,
    tracking_weight: float = 1.0,
    energy_weight: float = 0.5,
    copper_loss: float = 0.5,
    zmp: bool = True,
    cells: int = 200,
) -> SteadyBound:
    """Upper bound on the reward of a steady walk without slip, for each second.

    Rewards as of `BipedEnv`: energy_weight times positive work and copper loss [W/(N m)^2], over
    weight and commanded speed. mu: static friction. zmp: without toppling, too. Assumed: the walk
    repeats itself step by step, the foot does not slip, and the crank (so the centre of mass) does
    not turn back. Torque may change at any instant, and speed that varies within a step costs
    nothing here, so the bound is above what a motor that holds its torque can earn. ValueError for
    numbers out of range, and where no gait is found.
    """
    for name, given in (("mean_rate", mean_rate), ("tracking_weight", tracking_weight)):
        require_scalar(name, given, low=0.0, strict=True, accepted="a finite number > 0")
    require_scalar("energy_weight", energy_weight, low=0.0, accepted="a finite number >= 0")
    limits = {"mu": mu, "torque_limit": torque_limit, "copper_loss": copper_loss, "zmp": zmp}
    usual = np.pi / mean_rate
    robot = robot_of(params, 1, True)
    price = energy_weight * usual / (robot.weight * robot.step_length)

    def least(goal: dict[str, float]) -> tuple[float, float]:
        """Lower bound of a gait's cost, and the mean rate of the best."""
        answer = solve(GaitProblem.periodic(params, goal, steps=cells, **limits))
        if answer.every_bound is None or answer.gait is None:
            raise ValueError(f"no gait: {answer.message}; accepted: limits that leave one")
        return answer.every_bound, answer.gait.mean_rate

    fastest, rate = least({"time": 1.0})
    most = tracking_weight * usual / fastest  # beta where the share is 1 without any price
    if price == 0:
        return SteadyBound(float(min(most, tracking_weight)), rate)
    found: list[SteadyBound] = []

    def earned(beta: float) -> float:
        value, rate = least({"energy": price, "time": beta})
        share = value / (tracking_weight * usual)
        if share > 1:  # nothing is proved there: less beta is better
            return tracking_weight * share + beta
        found.append(SteadyBound(float(tracking_weight + beta - value / usual), rate))
        return found[-1].value

    ends = 1e-6 * tracking_weight, most
    options = {"xatol": CLOSE * most, "maxiter": MOST}
    searched: Any = minimize_scalar(earned, bounds=ends, method="bounded", options=options)
    if not found:
        raise ValueError(f"nothing is proved ({searched.message}); accepted: other weights")
    best = min(found)
    return best._replace(value=min(best.value, tracking_weight))
