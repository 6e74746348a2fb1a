"""Drives over ground far from x = 0 and y = 0: the same values, and bounds that hold against a slow
calculation; and what is said where postures have no numbers."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from stickslip.dynamics.ugv import Track, UGVParams
from stickslip.optim import OptimStatus, PostureProblem, solve
from stickslip.optim.posture.criteria import CRITERIA
from stickslip.optim.posture.evaluate import below
from stickslip.optim.posture.grid import build_grid
from tests.dynamics.ugv.slow import Slow
from tests.optim.posture.helpers import tiny

UP = 1500.0
X = 0.1 * np.arange(10_001)
Y = UP + 5 * np.sin(X / 50) + 0.03 * np.sin(2 * X) + 0.01 * np.sin(5 * X + 1)
AT = 6197
PLACES = X[AT] + np.array([0.0, 0.4, 0.8, 1.2])


@pytest.fixture(scope="module")
def slow():
    near = slice(AT - 80, AT + 80)
    return Slow(X[near], Y[near], (X[AT], Y[AT]))


@pytest.fixture(scope="module")
def truth(slow):
    """The least wheel energy of all drives over 3 x 3 angles, each one looked at."""
    return slow.best(PLACES - X[AT], np.array([1.2, 1.6, 2.0]))


def problem(**fields) -> PostureProblem:
    vehicle = UGVParams(leg_angle_min=1.2, leg_angle_max=2.0)
    given = {"leg_rate": None, "friction": 5.0, "min_clearance": 0.0} | fields
    return PostureProblem(vehicle, Track.from_points(X, Y), PLACES, **given)


@pytest.mark.parametrize("wide", [False, pytest.param(True, marks=pytest.mark.long)])
@pytest.mark.long
def test_a_bound_called_proved_holds_against_every_drive_looked_at(wide, truth):
    """On 1 km of points 0.1 m apart, 1500 m up; at the place once called infeasible."""
    with jax.enable_x64(wide):
        found = solve(problem(), "dp", polish=False, angles=3)
        assert found.status is OptimStatus.FEASIBLE
        np.testing.assert_allclose(found.value, truth, rtol=1e-12)
        assert truth * (1 - 1e-8) <= found.details["grid_bound"] <= truth


def test_the_value_of_any_drive_is_that_of_a_slow_calculation(slow):
    random = np.random.default_rng(4)
    for _ in range(5):
        x = random.uniform(1.2, 2.0, (4, 2))
        held = [slow.held(at - X[AT], pair) for at, pair in zip(PLACES, x, strict=True)]
        exact = slow.wheel_energy(held)
        found = problem().objective(x.reshape(-1))
        np.testing.assert_allclose(found, exact, rtol=1e-12)
        assert below(problem(), found) <= exact


@pytest.mark.parametrize("criterion", CRITERIA)
def test_every_value_is_the_same_wherever_the_ground_lies(criterion):
    x = 0.125 * np.arange(65)
    y = np.round(0.05 * np.sin(2 * x) * 2**18) / 2**18
    drive = np.random.default_rng(0).uniform(1.2, 2.0, 2 * 21)
    values = []
    for by, up in ((0.0, 0.0), (1024.0, UP)):
        at = 2.0 + by + 0.25 * np.arange(21)
        of = PostureProblem(UGVParams(), Track.from_points(x + by, y + up), at, criterion)
        values.append(of.objective(drive))
    np.testing.assert_allclose(*values, rtol=1e-12)


def test_what_postures_ended_with_is_told():
    ditch = replace(tiny(leg_rate=None, friction=3.0), track=Track.ditch(0.25, 3.35, 0.3, 0.15))
    found = solve(ditch, "dp", angles=3)
    assert found.status is OptimStatus.FAILED
    assert "pose rules out 9 of 9" in found.message
    assert "hollow ground: 9 of 9 pairs of angles there ended 9 HOLLOW_GROUND" in found.message


def test_a_given_pair_without_a_pose_proves_nothing():
    grid = build_grid(tiny(start_angles=(0.6, 0.6)), 3, 2)
    for group, status in (("pose", OptimStatus.FAILED), ("grip", OptimStatus.INFEASIBLE)):
        met = grid.layers[0].met | {group: np.zeros(1, bool)}
        lost = replace(grid, layers=[grid.layers[0]._replace(met=met), *list(grid.layers)[1:]])
        assert lost.without_path(0, False).status is status
