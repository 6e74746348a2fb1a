"""A result says what its drive costs between the waypoints, and whether it holds there."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.dynamics.ugv import Track
from stickslip.optim import OptimStatus, PostureProblem
from stickslip.optim.posture.problem import evaluate_finer, finer
from tests.optim.posture.helpers import over_bump, random_x


def at(problem, x, **others):
    return problem.result(x, method="guess", status=OptimStatus.FEASIBLE, began=0.0, **others)


@pytest.mark.parametrize("criterion", ["friction_demand", "total_energy"])
def test_it_is_the_value_of_the_finer_problem(criterion):
    ice = np.linspace(0.8, 0.3, 10)
    problem = replace(over_bump(criterion), friction=ice, leg_rate=2.0)
    x = random_x(problem)
    fine = finer(problem, 10)
    np.testing.assert_allclose(fine.x[::10], problem.x, rtol=1e-15)
    np.testing.assert_allclose(np.diff(fine.x), 0.06)
    angles = [np.interp(fine.x, problem.x, leg) for leg in problem.angles(x).T]
    whole = np.stack(angles, -1).ravel()
    np.testing.assert_allclose(fine.friction, np.interp(fine.x, problem.x, ice))
    found = at(problem, x)
    assert found.fine_value == pytest.approx(fine.objective(whole), rel=1e-9)
    assert found.fine_spacing == pytest.approx(0.06)
    assert found.fine_feasible == fine.is_feasible(whole)
    want = fine.residuals(whole)
    assert found.fine_residuals == pytest.approx(want, rel=1e-6, abs=1e-9)
    assert found.value == problem.objective(x)


def test_a_bump_between_two_waypoints_breaks_a_constraint_that_holds_at_both():
    narrow = Track.from_points([0.0, 3.9, 4.0, 4.1, 9.0], [0.0, 0.0, 0.06, 0.0, 0.0], "linear")
    problem = PostureProblem(over_bump().params, narrow, np.array([3.3, 3.7, 5.6, 6.0]),
                             friction=0.15)  # fmt: skip
    found = at(problem, np.full(problem.n, np.pi / 2))
    assert found.feasible
    assert not found.fine_feasible
    assert found.fine_residuals["grip"] > 100


def test_it_has_a_limit_of_its_own():
    x = np.linspace(2.0, 7.0, 40_000)
    problem = PostureProblem(over_bump().params, Track.flat(), x, leg_rate=None)
    assert evaluate_finer(problem, np.full(problem.n, 1.5))["fine_spacing"] == pytest.approx(
        5 / 39_999 / 3
    )
