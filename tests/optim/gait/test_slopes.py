"""Slopes of gaits, beside central differences of what is evaluated."""

from functools import partial
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.optimize
from scipy.integrate import quad

from stickslip.optim import OptimStatus, solve
from stickslip.optim.gait import gait as between
from stickslip.optim.gait.profile import Grid
from stickslip.optim.problem import Structure
from tests.optim.gait.helpers import periodic, transfer
from tests.trees import differences


@pytest.mark.parametrize(
    ("objective", "limits"),
    [
        ("time", {"mu": 0.2}),
        ({"energy": 1.0, "torque": 0.3}, {"mu": 0.3, "mean_rate": 3.0}),
        ("friction", {"mean_rate": 3.0}),
        ("time", {"max_power": 9.0, "max_torque_rate": 30.0}),
    ],
)
def test_gradient_and_jacobian_are_the_slopes_of_value_and_constraints(objective, limits):
    problem = periodic(objective, steps=14, **limits)
    assert Structure.SMOOTH in problem.structure
    x = np.concatenate([[9.0], 2.0 * np.random.default_rng(0).standard_normal(15)])
    for slope, function in (
        (problem.gradient(x), problem.objective),
        (problem.jacobian(x), problem.constraints),
    ):
        scale = np.max(np.abs(slope))
        assert scale > 0
        np.testing.assert_allclose(slope, differences(function, x, 1e-5), atol=1e-6 * scale)


def test_slsqp_comes_to_the_conic_optimum():
    problem = periodic("torque", mu=0.3, mean_rate=3.0, steps=14)
    best = solve(problem)
    found = scipy.optimize.minimize(
        problem.objective,
        np.concatenate([[9.5], np.zeros(15)]),
        jac=problem.gradient,
        method="SLSQP",
        bounds=list(zip(*problem.bounds, strict=True)),
        constraints={"type": "ineq", "fun": problem.constraints, "jac": problem.jacobian},
        options={"maxiter": 200, "ftol": 1e-10},
    )
    assert problem.is_feasible(found.x)
    np.testing.assert_allclose(found.fun, best.value, rtol=1e-5)


@pytest.mark.parametrize("make", [periodic, partial(transfer, 2, end_rate=0.0)])
def test_slsqp_finds_no_quicker_gait_near_one_within_the_torque_rate(make):
    problem = make(mu=0.3, max_torque_rate=30.0, steps=12)
    best, free = solve(problem), solve(make(mu=0.3, steps=12))
    assert best.status is OptimStatus.FEASIBLE
    assert best.value > 1.1 * free.value
    polished = solve(problem, method="gradient", start=best.x)
    assert polished.value > best.value * (1 - 1e-5)


def test_a_standing_crank_has_no_slope():
    problem = periodic("time", steps=14)
    assert problem.objective(np.zeros(16)) == np.inf
    np.testing.assert_array_equal(problem.gradient(np.zeros(16)), 0.0)


def times_of(grid: Grid, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Times of a gait's cells, which no robot decides."""
    profiles: Any = SimpleNamespace(grid=grid)
    return between.Gait(profiles, a, b).times


def test_a_cells_time_and_least_rate_are_those_of_its_parabola():
    grid = Grid(1, 40)
    rng = np.random.default_rng(3)
    for scale in (0.1, 3.0, 200.0):
        a = scale * rng.normal(size=grid.theta.shape)
        b = np.cumsum(np.pad(grid.h * (a[:, :-1] + a[:, 1:]), ((0, 0), (1, 0))), axis=1)
        b += 1e-3 * rng.uniform() - np.min(between.lowest(grid, a, b))
        times, lowest = times_of(grid, a, b), between.lowest(grid, a, b)
        c = np.diff(a, axis=1) / grid.h
        for k, h in enumerate(grid.h[0]):
            form = np.poly1d([c[0, k], 2 * a[0, k], b[0, k]])
            vertex = -a[0, k] / c[0, k]
            places = sorted({0.0, float(np.clip(vertex, 0, h)), h})
            parts = [
                quad(lambda x, form=form: form(x) ** -0.5, *pair, epsabs=0, epsrel=1e-11)[0]
                for pair in pairwise(places)
            ]
            assert times[0, k] == pytest.approx(sum(parts), rel=1e-9)
            assert lowest[0, k] == pytest.approx(min(form(np.array(places))), rel=1e-9)


def test_times_from_rest_and_to_rest_are_those_of_constant_acceleration():
    grid = Grid(1, 10, from_rest=True, to_rest=True)
    a = np.where(np.arange(11) < 5, 3.0, -3.0)[None]
    half = np.where(grid.theta[0] <= np.pi, grid.theta[0] - np.pi / 2, 1.5 * np.pi - grid.theta[0])
    b = 6.0 * half[None]
    b[0, -1] = -1e-15  # as rounding leaves it
    times = times_of(grid, a, b)
    assert times[0, 0] == pytest.approx(np.sqrt(2 * grid.h[0, 0] / 3.0))
    assert times[0, -1] == pytest.approx(np.sqrt(2 * grid.h[0, -1] / 3.0))
