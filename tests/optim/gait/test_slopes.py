"""Slopes of gaits, beside central differences of what is evaluated."""

import numpy as np
import pytest
import scipy.optimize

from stickslip.optim import solve
from stickslip.optim.problem import Structure
from tests.optim.gait.helpers import periodic


@pytest.mark.parametrize(
    ("objective", "limits"),
    [
        ("time", {"mu": 0.2}),
        ({"energy": 1.0, "torque": 0.3}, {"mu": 0.3, "mean_rate": 3.0}),
        ("friction", {"mean_rate": 3.0}),
    ],
)
def test_gradient_and_jacobian_are_the_slopes_of_value_and_constraints(objective, limits):
    problem = periodic(objective, steps=14, **limits)
    assert Structure.SMOOTH in problem.structure
    x = np.concatenate([[9.0], 2.0 * np.random.default_rng(0).standard_normal(15)])
    step = 1e-5

    def differences(function) -> np.ndarray:
        sides = [
            (function(x + step * one) - function(x - step * one)) / (2 * step) for one in np.eye(16)
        ]
        return np.stack(sides, axis=-1)

    for slope, function in (
        (problem.gradient(x), problem.objective),
        (problem.jacobian(x), problem.constraints),
    ):
        scale = np.max(np.abs(slope))
        assert scale > 0
        np.testing.assert_allclose(slope, differences(function), atol=1e-6 * scale)


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


def test_a_standing_crank_has_no_slope():
    problem = periodic("time", steps=14)
    assert problem.objective(np.zeros(16)) == np.inf
    np.testing.assert_array_equal(problem.gradient(np.zeros(16)), 0.0)
