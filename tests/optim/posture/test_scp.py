"""Sequential convex programming finds local optima off the grid, and says no more than that."""

import numpy as np
import pytest
from scipy.optimize import linprog

from stickslip.optim import OptimStatus, solve
from stickslip.optim.posture.scp import linearised
from tests.optim.posture.helpers import over_bump, random_x


@pytest.mark.parametrize("criterion", ["friction_demand", "total_energy", "torque_variation"])
def test_slopes_are_those_of_the_terms_and_terms_give_the_objective(criterion):
    problem = over_bump(criterion)
    x = random_x(problem, 1)
    at = linearised(problem, x)
    np.testing.assert_allclose(at.value, problem.objective(x), rtol=1e-12)
    way = np.random.default_rng(2).standard_normal(problem.n)
    ahead, behind = (linearised(problem, x + by * way) for by in (1e-6, -1e-6))
    pairs = way.reshape(-1, 2)
    moves = pairs if at.term_slopes.shape[-1] == 2 else np.hstack([pairs[:-1], pairs[1:]])
    along, slope = np.einsum("kmd,kd->km", at.term_slopes, moves), (ahead.terms - behind.terms)
    slope /= 2e-6
    np.testing.assert_allclose(along, slope, rtol=1e-6, atol=1e-6 * abs(slope).max())
    rows, groups = problem.jacobian(x), problem.constraint_groups
    for name, slopes in at.margin_slopes.items():
        along = np.einsum("kmd,kd->km", slopes, pairs).ravel()
        np.testing.assert_allclose(along, rows[groups[name]] @ way, atol=1e-10)


@pytest.mark.parametrize("goal", [pytest.param("grip", marks=pytest.mark.long), "wheel_energy"])
def test_it_leaves_the_grid_for_something_at_least_as_good(goal):
    problem = over_bump(goal)
    grid = solve(problem, "dp", polish=False, angles=9)
    found = solve(problem, "scp", start=grid.x)
    assert found.status is OptimStatus.FEASIBLE, found.message
    assert found.feasible
    assert found.lower_bound is None
    assert found.value <= grid.value + 1e-9 * abs(grid.value)
    assert found.value == problem.objective(found.x)


def middle(problem):
    return np.mean(problem.bounds, axis=0)


def least_promised(problem, x, radius):
    """The least linear model of the objective in a box about x, by an LP that is written out here.

    For sums of positive parts and for worst stations; constraints linear, from the jacobian.
    """
    at = linearised(problem, x)
    terms, slopes = at.terms, at.term_slopes
    rows, m, d = slopes.shape
    peak = problem.criterion.kind == "max"
    tops = 1 if peak else rows * m
    above = np.zeros((rows * m, problem.n + tops))
    for k in range(rows):
        for j in range(m):
            above[k * m + j, 2 * k : 2 * k + d] = slopes[k, j]
            above[k * m + j, problem.n + (0 if peak else k * m + j)] = -1
    held, limits = problem.jacobian(x), np.maximum(problem.constraints(x), 0)
    A = np.vstack([above, np.hstack([-held, np.zeros((len(held), tops))])])
    b = np.concatenate([-terms.ravel(), limits])
    low, high = (side - x for side in problem.bounds)
    box = np.stack([np.maximum(low, -radius), np.minimum(high, radius)], -1)
    tops_box = [(None if peak else 0, None)] * tops
    cost = np.concatenate([np.zeros(problem.n), np.ones(tops)])
    return linprog(cost, A, b, bounds=[*box, *tops_box], method="highs").fun


@pytest.mark.parametrize("criterion", ["wheel_energy", "peak_torque"])
def test_where_it_ends_no_linear_model_promises_more(criterion):
    """First-order optimality, by another solver and another way to write the model."""
    problem = over_bump(criterion)
    found = solve(problem, "scp", start=middle(problem), tolerance=1e-9)
    promised = least_promised(problem, found.x, 1e-4)
    begun = least_promised(problem, random_x(problem, 3), 1e-4)
    gain = problem.objective(random_x(problem, 3)) - begun
    assert gain > 0
    assert found.value - promised <= 1e-6 * abs(found.value)


def test_given_ends_and_leg_rates_are_kept_from_any_start():
    problem = over_bump(leg_rate=0.4, start_angles=(1.2, 1.8), end_angles=(1.5, 1.6))
    jagged = np.tile([0.6, 2.5, 2.5, 0.6], 5)
    found = solve(problem, "scp", start=jagged)
    assert found.status is OptimStatus.FEASIBLE, found.message
    np.testing.assert_allclose(found.leg_angles[[0, -1]], [[1.2, 1.8], [1.5, 1.6]], atol=1e-12)
    rates = np.abs(np.diff(found.leg_angles, axis=0)) / np.diff(problem.x)[:, None]
    assert np.max(rates) <= 0.4 + 1e-6


def test_ends_that_the_rate_cannot_join_are_infeasible_and_said_to_be():
    problem = over_bump(leg_rate=0.01, start_angles=(0.6, 0.6), end_angles=(2.5, 2.5))
    found = solve(problem, "scp", start=middle(problem))
    assert found.status is OptimStatus.INFEASIBLE
    assert "leg_rate" in found.message
    assert found.x is None


def test_a_floor_too_slippery_is_violated_and_says_what_is_missed():
    problem = over_bump("wheel_energy", friction=0.01)
    found = solve(problem, "scp", start=middle(problem))
    assert found.status is OptimStatus.VIOLATED
    assert not found.feasible
    assert "grip" in found.message
    assert found.residuals["grip"] > 1.0


def test_a_limit_of_iterations_is_no_solution():
    problem = over_bump("wheel_energy")
    found = solve(problem, "scp", start=middle(problem), iterations=2)
    assert found.status is OptimStatus.LIMIT
    assert found.details["steps"] == 2
