"""Gaits walked in simulation keep what they promise."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.biped import kinematics, step_length
from stickslip.dynamics.biped.inertia import body_masses
from stickslip.optim import replay, solve
from stickslip.optim.gait.replay import GaitLaw
from tests.optim.gait.helpers import robot, solved, transfer

MU, RESERVE = 0.06, 0.02


def test_a_periodic_gait_walks_without_a_slip_at_the_promised_speed_and_energy():
    found = solved("energy", mu=MU * (1 - RESERVE), mean_rate=4.5, steps=200)
    walked = replay(robot(), found.best, mu=MU, walk_steps=2)
    assert walked.kept, walked
    assert walked.mean_rate == pytest.approx(found.best.mean_rate, rel=1e-5)
    assert walked.work == pytest.approx(2 * found.best.spent["work"], rel=1e-4)
    assert walked.rate_error < 1e-3
    slipped = replay(robot(), found.best, mu=0.8 * MU, walk_steps=1)
    assert not slipped.kept
    assert slipped.slid > 1e-4


def test_a_start_from_rest_and_a_stop_walk_as_promised():
    found = solve(transfer(2, mu=MU * (1 - RESERVE), end_rate=0.0, steps=200))
    walked = replay(robot(), found.best, mu=MU)
    assert walked.kept, walked
    assert walked.duration == pytest.approx(found.best.duration, rel=2e-3)
    assert walked.end_rate < 0.1
    quick = solve(transfer(1, mu=MU * (1 - RESERVE), end_rate=3.0, steps=100))
    assert replay(robot(), quick.best).rate_error < 1e-2  # ends at an exchange of support


def test_a_stop_inside_a_step_is_at_its_mark_and_its_torque_changes_slowly_over_time():
    stop = transfer(None, mu=0.95 * MU, end_rate=0.0, max_torque_rate=20.0, distance=0.33)
    gait = solve(stop).best
    links = [kinematics(robot(), gait.theta[i, i]).centres for i in (0, -1)]
    start, end = (np.average(one[:, 0], weights=body_masses(robot())) for one in links)
    assert stop.steps_taken == 2
    assert end + float(step_length(robot())) - start == pytest.approx(0.33, abs=1e-6)
    assert gait.torque[1, 0] == pytest.approx(gait.torque[0, -1], abs=1e-8)
    assert np.max(np.abs(np.diff(gait.torque)) / gait.times) == pytest.approx(20.0, rel=1e-2)
    assert replay(robot(), gait, mu=MU).kept
    with pytest.raises(ValueError, match="walk_steps = 3"):
        replay(robot(), gait, walk_steps=3)


def test_feedback_takes_away_what_another_robot_makes_of_the_torque():
    found = solved("energy", mu=MU * (1 - RESERVE), mean_rate=4.5, steps=200)
    heavier = robot(payload=0.02)
    walks = [replay(heavier, found.best, feedback=gain, walk_steps=4) for gain in (0.0, 4.0)]
    assert walks[1].rate_error < 0.7 * walks[0].rate_error


def test_the_traced_law_is_the_gait(float64: object):
    gait = solve(transfer(2, mu=0.2, steps=40)).best
    law = GaitLaw.of(gait)
    phases = np.linspace(gait.theta[0, 0] + 0.01, gait.theta[0, -1] - 0.01, 56)
    for step in range(2):
        a, b = jax.vmap(law.at, (None, 0, None))(None, jnp.asarray(phases), jnp.asarray(step))
        np.testing.assert_allclose(a, np.interp(phases, gait.theta[step], gait.a[step]), rtol=1e-12)
        begins = np.searchsorted(gait.theta[step], phases) - 1
        gained = (a + gait.a[step, begins]) * (phases - gait.theta[step, begins])
        np.testing.assert_allclose(b, gait.b[step, begins] + gained, rtol=1e-12)


def test_what_cannot_be_walked_is_refused():
    gait = solved("energy", mu=MU, mean_rate=4.5, steps=60).best
    for options, said in (
        ({"mu": -1.0}, "mu = -1.0"),
        ({"mu_kinetic": 0.1}, "mu_kinetic = 0.1 without mu"),
        ({"feedback": np.nan}, "feedback = nan"),
        ({"walk_steps": 0}, "walk_steps"),
    ):
        with pytest.raises(ValueError, match=said):
            replay(robot(), gait, **options)
    still = replace(gait, b=np.zeros_like(gait.b))
    with pytest.raises(ValueError, match="stands still"):
        replay(robot(), still)
