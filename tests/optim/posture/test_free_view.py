"""The view of the free angles is the problem, its given angles filled in."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.optim import OptimStatus, solve
from tests.optim.posture.helpers import over_bump, random_x

ENDS = {"start_angles": (1.5, 1.6), "end_angles": (1.6, 1.5)}


@pytest.fixture(scope="module")
def problem():
    return over_bump("torque_variation", **ENDS)


def test_its_functions_are_the_problems_with_the_ends_filled_in(problem):
    free, x = problem.free, random_x(problem)
    x[:2], x[-2:] = ENDS["start_angles"], ENDS["end_angles"]
    short = free.reduce(x)
    assert short.shape == (free.n,) == (16,)
    np.testing.assert_array_equal(free.expand(short), x)
    np.testing.assert_array_equal(free.expand(np.stack([short, short])), [x, x])
    assert free.objective(short) == problem.objective(x)
    np.testing.assert_array_equal(free.objectives(short[None]), problem.objectives(x[None]))
    np.testing.assert_array_equal(free.gradient(short), problem.gradient(x)[2:-2])
    np.testing.assert_array_equal(free.constraints(short), problem.constraints(x))
    np.testing.assert_array_equal(free.jacobian(short), problem.jacobian(x)[:, 2:-2])
    assert free.is_feasible(short) == problem.is_feasible(x)
    assert free.is_feasible(short, 10.0)


def test_no_bounds_are_equal_and_a_problem_without_given_ends_is_itself(problem):
    low, high = problem.free.bounds
    assert np.all(low < high)
    whole = over_bump("torque_variation")
    assert whole.free.n == whole.n
    np.testing.assert_array_equal(whole.free.bounds, whole.bounds)


@pytest.mark.long
@pytest.mark.parametrize("method", ["dp", "scp", "gradient", "cma"])
def test_where_no_angle_is_free_every_method_returns_the_given_ones(problem, method: str):
    pytest.importorskip("cma")
    only = replace(problem, x=np.array([3.3, 3.7]))
    assert only.free.n == 0
    options = {"angles": 3} if method == "dp" else {}
    found = solve(only, method, **options)
    assert found.status in (OptimStatus.OPTIMAL, OptimStatus.FEASIBLE)
    np.testing.assert_array_equal(found.x, [1.5, 1.6, 1.6, 1.5])
