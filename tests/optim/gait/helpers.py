"""Robots, problems, and what is worked out apart from the package's own programs."""

from functools import cache

import numpy as np

from stickslip.dynamics.biped import BipedParams
from stickslip.optim import GaitProblem, GaitResult, solve

LIMIT = 4.0
"""The motor's torque [N m]."""


@cache
def robot(**changes: float) -> BipedParams:
    return BipedParams.from_bars(**changes)


def periodic(objective="time", **options) -> GaitProblem:
    return GaitProblem.periodic(robot(), objective, **({"torque_limit": LIMIT} | options))


def transfer(count: int, objective="time", **options) -> GaitProblem:
    return GaitProblem.transfer(robot(), count, objective, **({"torque_limit": LIMIT} | options))


@cache
def solved(objective: str = "time", **options) -> GaitResult:
    """A periodic gait of the reference robot, kept."""
    return solve(periodic(objective, **options))


def quickest_on_a_lattice(problem: GaitProblem, cells: int = 30, levels: int = 900) -> float:
    """Time [s] of the quickest walk over a lattice of phases and squared rates, by dynamic
    programming; limits are looked at in the middle of each cell."""
    at = problem.on_grid
    theta = np.linspace(np.pi / 2, 3 * np.pi / 2, cells + 1)
    middle = (theta[1:] + theta[:-1]) / 2
    p = at.profiles.nodes
    names = ("M", "dM", "P", "dP", "Y", "dY")
    rows = {name: np.interp(middle, p.theta[0], getattr(p, name)[0]) for name in names}
    h, weight = np.pi / cells, p.robot.weight
    b = np.linspace(0.0, 12.0**2, levels)
    start = int(np.argmin(np.abs(b - at.first[0])))
    cost = np.full(levels, np.inf)
    cost[start] = 0.0
    a = (b[None] - b[:, None]) / (2 * h)
    mean = (b[None] + b[:, None]) / 2
    with np.errstate(divide="ignore"):
        pace = 2 * h / (np.sqrt(b)[:, None] + np.sqrt(b)[None])
    for k in range(cells):
        M, dM, P, dP, Y, dY = (rows[name][k] for name in rows)
        T = M * a + dM / 2 * mean + p.robot.gravity * Y
        f, N = P * a + dP * mean, weight + Y * a + dY * mean
        fine = (np.abs(T) <= at.torque) & (np.abs(f) <= at.mu[0] * N)
        cost = np.min(np.where(fine, cost[:, None] + pace, np.inf), axis=0)
    return float(np.min(cost))
