"""Starts and stops during which the foot may slip: bounds, limits, replays."""

import numpy as np
import pytest

from stickslip.dynamics.status import Status
from stickslip.optim import GaitProblem, slip_transfer, solve
from stickslip.optim.gait import slip_transfer as module
from tests.optim.gait.helpers import LIMIT, robot, transfer

COARSE = {"LEVELS": 61, "ROUNDS": 5}
RATE, NEEDED = 6.0, 0.0188
"""Crank rate [rad/s], and the friction that a stop from it within a step needs without slip."""


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    for name, value in COARSE.items():
        monkeypatch.setattr(module, name, value)


def stop(mu: float, **options) -> GaitProblem:
    return transfer(1, start_rate=RATE, end_rate=0.0, mu=mu, **options)


@pytest.mark.long
def test_a_floor_too_slippery_to_brake_without_slip_is_slid_over_and_the_replay_stops_there():
    problem = stop(0.014)
    assert problem.mu < NEEDED
    assert not solve(problem).feasible
    walk = slip_transfer(problem, 0.014 / 1.2, reserve=0.05, cells=24)
    assert walk.feasible
    nodes = walk.nodes
    speed = RATE * nodes.P[0, 0] / nodes.robot.mass
    assert walk.distance > 0.95 * speed**2 / (2 * problem.mu * 9.81)  # of constant friction
    assert 0.24 + walk.displacement == pytest.approx(walk.distance, abs=1e-6)
    assert walk.lower_bound == pytest.approx(speed / (problem.mu * 9.81), rel=0.01)
    assert walk.lower_bound < walk.value == pytest.approx(walk.clock[-1, -1])
    assert np.max(np.abs(walk.torque)) <= LIMIT
    assert np.trapezoid(np.ravel(walk.foot_velocity), np.ravel(walk.clock)) == pytest.approx(
        walk.displacement, rel=0.02
    )
    found = walk.replay
    assert found is not None
    assert found.status == Status.SLIP_ONSET
    assert found.slid == pytest.approx(walk.slid, rel=0.01)
    assert found.duration == pytest.approx(walk.duration, rel=1e-3)
    assert walk.arrives


@pytest.mark.long
def test_where_no_torque_can_make_the_foot_slip_the_best_walk_is_that_of_the_convex_program():
    problem = transfer(1, end_rate=5.0, mu=1.0, torque_limit=1.5)
    best, walk = solve(problem), slip_transfer(problem, 0.8, reserve=0.0, cells=24)
    assert walk.slid == 0
    assert best.lower_bound < walk.value < 1.15 * best.value
    assert walk.arrives


@pytest.mark.long
def test_a_slip_shortens_a_start_that_keeps_its_steps():
    problem = transfer(1, end_rate=4.0, mu=0.012)
    still, walk = solve(problem), slip_transfer(problem, 0.01, reserve=0.02, cells=24)
    assert walk.lower_bound < walk.value < still.lower_bound
    assert walk.displacement < -0.01
    assert walk.replay.slid == pytest.approx(walk.slid, rel=0.03)


@pytest.mark.long
def test_the_centre_of_mass_stops_at_the_mark_though_the_foot_slides(monkeypatch):
    monkeypatch.undo()  # a coarse search does not come to the mark
    problem = transfer(None, start_rate=5.0, end_rate=0.0, mu=0.02, distance=0.3)
    walk = slip_transfer(problem, 0.0167, reserve=0.05)
    assert walk.feasible
    assert abs(walk.displacement) > 1e-3
    assert walk.distance == pytest.approx(0.3, abs=1e-3)


def test_what_it_does_not_take_is_refused():
    periodic = GaitProblem.periodic(robot(), mu=0.1, torque_limit=LIMIT)
    refused = [
        (periodic, 0.1, "accepted: a transfer with one mu"),
        (transfer(2, mu=[0.1, 0.2]), 0.1, "accepted: a transfer with one mu"),
        (stop(0.1, max_torque_rate=5.0), 0.1, "max_torque_rate"),
        (stop(0.1), 0.2, "accepted: 0 to mu = 0.1"),
        (stop(0.0), 0.0, "accepted: a number > 0"),
    ]
    for problem, kinetic, words in refused:
        with pytest.raises(ValueError, match=words):
            slip_transfer(problem, kinetic)
