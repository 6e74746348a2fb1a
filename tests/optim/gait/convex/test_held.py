"""Gaits held between their nodes: motions in time and samples beside what is promised."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, PPoly

from stickslip.optim import GaitProblem, solve
from stickslip.optim.gait.convex.grid_problem import STANDING
from stickslip.optim.gait.gait import Gait, lowest
from tests.optim.gait.helpers import robot, transfer

FINE = 201
"""Places a cell."""
SLOW = [
    ("work", {}, {"mu": 0.5, "mean_rate": 1.5, "steps": 60}),
    ("energy", {"payload": 10.0, "gravity": 3.7}, {"mu": 0.3, "mean_rate": 0.8, "steps": 40}),
]
"""Gaits of the grid whose crank comes to rest between two nodes."""


def problem_of(objective: str, given: dict, limits: dict) -> GaitProblem:
    return GaitProblem.periodic(robot(**given), objective, **limits)


def sampled(problem: GaitProblem, gait: Gait):
    """The profile, a and b at FINE places in each cell, the profile exact."""
    x = gait.grid.h[..., None] * np.linspace(0.0, 1.0, FINE)
    profile = problem.on_grid.profiles.at(gait.theta[:, :-1, None] + x)
    c = (np.diff(gait.a, axis=1) / gait.grid.h)[..., None]
    a = gait.a[:, :-1, None]
    return profile, a + c * x, gait.b[:, :-1, None] + 2 * a * x + c * x**2


def slowest_of(gait: Gait) -> float:
    """Least b at the nodes and between them."""
    return float(np.min(lowest(gait.grid, gait.a, gait.b)))


@pytest.mark.parametrize(("objective", "given", "limits"), SLOW)
def test_a_held_gait_never_stands_still_and_is_as_fast_as_it_says(objective, given, limits):
    problem = problem_of(objective, given, limits)
    gait = solve(problem).held
    assert gait is not None
    slowest = slowest_of(gait)
    assert slowest > 0
    assert np.min(sampled(problem, gait)[2]) >= slowest * (1 - 1e-9)
    walked = integrated(problem, gait)
    assert gait.duration == pytest.approx(walked["time"], rel=1e-6)
    for term in ("work", "torque"):
        assert gait.spent[term] == pytest.approx(walked[term], rel=1e-4), term
    assert np.pi / walked["time"] >= limits["mean_rate"] * (1 - 1e-6)


def integrated(problem: GaitProblem, gait: Gait) -> dict[str, float]:
    """What the gait spends, as a motion in time: theta' = rate, to 1e-10."""
    profile, a, b = sampled(problem, gait)
    theta, at = np.unique(profile.theta[0].ravel(), return_index=True)
    torque = CubicSpline(theta, profile.torque(a, b)[0].ravel()[at])
    rise = np.diff(gait.a[0]) / gait.grid.h[0]
    squared = PPoly(np.stack([rise, 2 * gait.a[0, :-1], gait.b[0, :-1]]), gait.theta[0])

    def rates(time: float, now: np.ndarray) -> list[float]:
        T, rate = float(torque(now[0])), float(np.sqrt(squared(now[0])))
        return [rate, T**2, max(T, 0.0) * rate]

    def over(time: float, now: np.ndarray) -> float:
        return now[0] - theta[-1] + 1e-9

    over.terminal = True
    start = [theta[0], 0.0, 0.0]
    most = (0.0, 2 * gait.duration)
    found = solve_ivp(rates, most, start, rtol=1e-9, atol=1e-13, events=over, max_step=0.02)
    names = ("torque", "work")
    return {"time": float(found.t[-1])} | dict(zip(names, found.y[1:, -1], strict=True))


def test_a_gait_of_the_grid_that_stands_still_between_nodes_has_no_mean_rate():
    found = solve(problem_of(*SLOW[0]), certify="grid")
    assert np.min(found.gait.b) >= 0
    assert slowest_of(found.gait) < 0
    assert np.isinf(found.gait.duration)
    assert found.mean_rate == 0.0


@pytest.mark.parametrize("walk", [{"end_rate": 0.0}, {"start_rate": 2.0}])
def test_a_walk_without_any_mean_rate_asked_for_moves_all_the_same(walk: dict):
    gait = solve(transfer(2, "work", mu=0.2, steps=40, **walk)).held
    b = np.concatenate([row[(0 if i else 1) : -1] for i, row in enumerate(gait.b)])
    assert np.min(b) > 0
    assert np.isfinite(gait.duration)


def test_where_no_gait_is_held_between_the_nodes_the_message_says_so():
    fastest = solve(problem_of("time", {}, {"mu": 0.1, "torque_limit": 4.0, "steps": 16}))
    asked = 0.99999 * np.pi / fastest.value
    limits = {"mu": 0.1, "torque_limit": 4.0, "steps": 16, "mean_rate": asked}
    found = solve(problem_of("energy", {}, limits))
    assert found.held is None
    assert "no gait was found that keeps its limits between the nodes" in found.message


def test_the_friction_that_a_gait_asks_for_is_that_between_the_nodes():
    limits = {"mean_rate": 2.0, "torque_limit": 4.0, "steps": 24}
    problem = problem_of("friction", {"payload": 5.0, "gravity": 3.7}, limits)
    found = solve(problem)
    profile, a, b = sampled(problem, found.held)
    friction, normal = profile.friction(a, b), profile.normal(a, b)
    assert found.held_value == pytest.approx(np.max(np.abs(friction) / normal), rel=1e-3)
    assert found.held.friction_use == found.held_value > found.value


@pytest.mark.parametrize(
    ("given", "limits"),
    [
        ({}, {"mu": 0.15225, "torque_limit": 2.5285, "steps": 60}),
        ({"payload": 10.0}, {"mu": 0.1, "torque_limit": 6.0, "steps": 40, "zmp": True}),
    ],
)
def test_held_limits_are_kept_at_every_place_to_a_hundred_millionth(given: dict, limits: dict):
    problem = problem_of("time", given, limits)
    gait = solve(problem).held
    profile, a, b = sampled(problem, gait)
    rows = problem.on_grid.rows_of(profile)
    excess = rows.excess(a, b) / rows.size[:, None, None, None]
    kept = [name != STANDING for name in rows.names]
    assert np.max(excess[kept]) <= 1.01e-8
