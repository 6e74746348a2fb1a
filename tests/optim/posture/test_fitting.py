"""The default grid lets the legs use their rate and runs through given ends."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.optim import OptimStatus, solve
from stickslip.optim.posture.waypoints import FINEST, fitting_grid, step_of, windows_of
from tests.optim.posture.helpers import HIGH, LOW, over_bump, tiny

ANGLE = st.floats(LOW, HIGH)
SPACING = 0.6
"""Of the waypoints of over_bump [m]."""


def limits(problem):
    return problem.leg_rate * np.diff(problem.x)


def rate_used(angles, limits):
    """The share of its rate that a leg can use on these angles; 1 where it reaches them all."""
    windows = windows_of(angles, limits)
    if np.all(windows == len(angles) - 1):
        return 1.0
    return np.sum(windows) * step_of(angles) / np.sum(limits)


@given(rate=st.floats(0.08, 3.0), start=st.tuples(ANGLE, ANGLE), least=st.integers(2, 60))
@settings(max_examples=100)
def test_steps_divide_the_rate_and_run_through_the_given_start(rate, start, least):
    problem = replace(over_bump(), leg_rate=rate, start_angles=start)
    for leg, angles in enumerate(fitting_grid(problem, least)):
        step = angles[1] - angles[0]
        np.testing.assert_allclose(np.diff(angles), step, rtol=1e-9)
        assert rate_used(angles, limits(problem)) >= 1 - 1e-9
        assert np.min(np.abs(angles - problem.start_angles[leg])) < 1e-9
        assert LOW <= angles[0] < LOW + step + 1e-9
        assert HIGH >= angles[-1] > HIGH - step - 1e-9
        assert least <= len(angles) <= max(FINEST, least)


@given(start=ANGLE, end=ANGLE)
@settings(max_examples=100)
def test_through_both_given_ends_where_a_step_leads_from_one_to_the_other(start, end):
    problem = replace(over_bump(), leg_rate=0.3, start_angles=(start,) * 2, end_angles=(end,) * 2)
    rear, _ = fitting_grid(problem)
    assert np.min(np.abs(rear - start)) < 1e-9
    used = rate_used(rear, limits(problem))
    through = np.min(np.abs(rear - end)) < 1e-9
    assert used >= (0.95 if through else 1 - 1e-9)
    finest = 0.3 * SPACING / int(0.3 * SPACING * (FINEST - 1) / (HIGH - LOW))
    if abs(end - start) > 20 * finest:
        assert through


def test_no_rate_no_choice_and_a_rate_too_low_for_any_fitting_grid():
    plain = np.linspace(LOW, HIGH, 31)
    np.testing.assert_array_equal(fitting_grid(replace(over_bump(), leg_rate=None))[0], plain)
    slow = replace(over_bump(), leg_rate=1e-3)
    np.testing.assert_array_equal(fitting_grid(slow)[0], plain)
    near = fitting_grid(replace(slow, start_angles=(1.5, 1.6)))[1]
    assert near[0] == pytest.approx(1.6 - 5.4e-3)  # as far as the leg can get
    assert rate_used(near, limits(slow)) == pytest.approx(1)
    fixed = replace(over_bump().params, leg_angle_min=1.5, leg_angle_max=1.5)
    assert fitting_grid(replace(over_bump(), params=fixed))[0].tolist() == [1.5]


def test_a_drive_off_the_grid_may_be_below_the_grids_bound_but_never_below_its_own():
    problem = tiny("torque_variation")
    grid = solve(problem, "dp", polish=False, angles=3)
    found = solve(problem, "dp", angles=3)
    assert found.status is OptimStatus.FEASIBLE
    assert found.method == "dp"
    assert found.feasible
    assert found.value < grid.value
    assert found.value == problem.objective(found.x)
    assert found.lower_bound is None
    assert found.gap == np.inf
    assert found.value < found.details["grid_bound"] == grid.details["grid_bound"] <= grid.value
    assert found.details["grid_value"] == grid.value
    np.testing.assert_array_equal(found.details["grid_angles"], grid.leg_angles)
    assert f"whose value is {grid.value:.8g}" in found.message


def test_a_path_that_cannot_be_polished_stays_proved(monkeypatch):
    problem = tiny("torque_variation")
    grid = solve(problem, "dp", polish=False, angles=3)
    same = solve(problem, "scp", start=grid.x, iterations=0)
    monkeypatch.setattr("stickslip.optim.posture.scp.solve_scp", lambda *of, **options: same)
    found = solve(problem, "dp", angles=3)
    assert (found.status, found.message) == (grid.status, grid.message)
    np.testing.assert_array_equal(found.x, grid.x)
    assert found.details["polish"].startswith("LIMIT")
