"""Where no drive meets the constraints it is said where, which one and what would do."""

import itertools
from dataclasses import replace

import jax
import numpy as np
import pytest

from stickslip.dynamics.ugv import Track
from stickslip.optim import OptimStatus, PostureProblem, solve
from stickslip.optim.posture import evaluate
from tests.optim.posture.helpers import HIGH, LOW, over_bump


def lost(problem, **options):
    found = solve(problem, "dp", polish=False, **{"angles": 5} | options)
    assert found.status in (OptimStatus.FAILED, OptimStatus.INFEASIBLE)
    assert (found.x, found.value) == (None, np.inf)
    return found.details


@pytest.mark.parametrize("free", [{"min_grip": 200.0, "max_torque": 250.0}, {"min_grip": 0}, None])
def test_the_least_friction_is_enough_and_a_little_less_is_not(free):
    problem = over_bump(friction=0.01, free_split=free is not None, **free or {})
    needed = lost(problem)["least_friction"]
    for mu in (needed * (1 + 1e-8), 1.01 * needed, 1.5 * needed):
        assert solve(replace(problem, friction=mu), "dp", angles=5, polish=False).feasible
    lost(replace(problem, friction=needed * (1 - 1e-6)))
    assert not free or lost(replace(problem, min_normal=1.0))["least_friction"] is None


def test_no_friction_helps_against_a_weak_motor_which_is_named_with_its_place():
    problem = over_bump(max_torque=0.01)
    details = lost(problem)
    assert details["least_friction"] is None
    torque = np.abs(problem.stations(details["closest"].reshape(-1)).torque)
    ((name, (by, at)),) = details["misses"].items()
    assert (name, at) == ("torque", problem.x[np.argmax(torque)])
    assert by == pytest.approx(np.max(torque) - 0.01)
    assert problem.x[0] <= details["blocked"][0, 0] <= details["blocked"][0, 1] <= problem.x[-1]


@pytest.mark.parametrize("given", [{}, {"start_angles": (1.5, 1.5)}])
def test_the_closest_drive_misses_least_of_all_paths_over_the_grid(given):
    """Every path over 3 x 3 angles at 4 waypoints."""
    problem = over_bump(friction=0.01, leg_rate=2.0, **given)
    problem = replace(problem, x=problem.x[2:6])
    closest = lost(problem, angles=3)["closest"]

    def missed(angles):
        margins = problem.limits.margins(problem.stations(angles.reshape(-1)))
        worst = [np.maximum(-np.min(of, -1), 0) for name, of in margins.items() if name != "pose"]
        return float(np.sum(np.max(worst, axis=0)))

    each = np.linspace(LOW, HIGH, 3)
    pairs = np.array(list(itertools.product(each, repeat=2)))
    first = pairs if problem.start_angles is None else problem.start_angles[None]
    moves = 2.0 * np.diff(problem.x) + 1e-9
    paths = np.array(list(itertools.product(first, pairs, pairs, pairs)))
    paths = paths[np.all(np.abs(np.diff(paths, axis=1)) <= moves[:, None], axis=(1, 2))]
    with jax.enable_x64(True):
        assert missed(closest) == pytest.approx(min(map(missed, paths)), rel=1e-5)


@pytest.mark.long
def test_the_steepest_place_is_that_of_the_track():
    found = lost(PostureProblem.along(Track.ramp(slope=0.5), spacing=0.5, friction=0.01))
    angle, at = found["steepest"]
    assert angle == pytest.approx(np.arctan(0.5))
    assert 2.5 <= at <= 5.5


@pytest.mark.long
def test_hollow_ground_is_placed_and_the_treatment_named():
    track = Track.from_points([0.0, 3.0, 3.1, 3.2, 8.0], [0.0, 0.0, -0.5, 0.0, 0.0], "pchip")
    found = solve(PostureProblem.along(track, spacing=0.1), "dp", angles=3, polish=False)
    assert found.details["closest"] is None
    assert found.details["blocked"][0, 0] == pytest.approx(3.0, abs=0.3)
    assert "--ground envelope" in found.message
    assert np.tan(found.details["steepest"][0]) == pytest.approx(7.5)  # between waypoints


@pytest.mark.long
def test_stations_over_a_part_of_long_ground_are_those_over_all_of_it():
    """Pieces about the vehicle in place of all of them, also at both ends of the track."""
    x = np.linspace(0.0, 300.0, 3001)
    y = 0.3 * np.sin(x) + 0.05 * np.sin(3 * x)
    for places in (x, np.sqrt(x * 300.0) * 0.5 + x * 0.5):  # evenly spaced, and not
        problem = PostureProblem.along(Track.from_points(places, y), spacing=3.0)
        posture = problem.posture
        short = posture.odometer.between(100.0, 110.0)
        assert len(short.track.shape.lows) < 300
        angles = np.tile([1.2, 1.9], (len(problem.x), 1))
        with jax.enable_x64(True):
            whole = np.asarray(posture.stations(angles).rows)
        for k in (0, 50, len(problem.x) - 1):
            part = evaluate.rows_at(posture, problem.x[[k]], 0.8, angles[[k]])
            np.testing.assert_allclose(part, whole[:, [k]], rtol=1e-9, atol=1e-9)


def test_all_calls_of_a_long_drive_share_one_program():
    """Compiling a program takes as long as a million stations."""
    x = np.linspace(0.0, 300.0, 3001)
    problem = PostureProblem.along(Track.from_points(x, 0.3 * np.sin(x)), spacing=0.1)
    calls = problem.waypoints.calls
    assert len(calls) > 2
    given = [rows.args for rows, _ in calls]  # a program, and its leaves
    assert len({id(program) for program, _ in given}) == 1
    shapes = {tuple(leaf.shape for leaf in leaves) for _, leaves in given}
    assert len(shapes) == 1
