"""The extremes: each ends in a finite number or in a status."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.pytrees import rebuilt
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import Track, UGVParams
from tests.dynamics.ugv.helpers import balanced, drawn

pytestmark = pytest.mark.long

NUMBERS = ("F_rear", "N_rear", "F_front", "N_front", "torque", "grip_rear", "leg_torques")


def finite_or_told(state):
    """Every number is finite unless the status says that there is no pose."""
    lost = np.isin(np.asarray(state.status), (Status.NO_SOLUTION, Status.NON_FINITE))
    for name in NUMBERS:
        value = np.asarray(getattr(state, name)).reshape(len(lost), -1)
        assert np.all(np.isfinite(value).all(1) | lost), name
    assert np.all(np.isfinite(np.asarray(state.pose.rear.x)) | lost)


@pytest.mark.parametrize("radius", [0.01, 0.05, 0.28, 0.8])
def test_wheels_from_the_size_of_the_bumps_to_that_of_the_wheelbase(float64, radius):
    params = UGVParams(wheel_radius=radius)
    track = Track.sinusoid(0.02, 0.3).astype(float64)  # least radius of curvature 0.11 m
    x, angles = drawn(params, float64)
    state = balanced(params, track, x, angles)
    finite_or_told(state)
    good = np.asarray(state.pose.status) == Status.OK
    hollow = np.asarray(state.pose.status) == Status.HOLLOW_GROUND
    assert np.all(good | hollow)
    assert np.all(good) if radius < 0.1 else hollow.any()


def test_a_leg_stretched_or_folded_until_the_wheelbase_vanishes(float64):
    """With legs as long as half the body, flat inwards, the wheels meet at one point."""
    fields = {"body_length": 0.7, "leg_length": 0.35, "leg_angle_min": 0.0}
    params = rebuilt(UGVParams(), **fields)  # the constructor refuses it
    folded = jnp.asarray([[0.0, 0.0], [1e-9, 1e-9], [1e-3, 1e-3], [np.pi, np.pi]])
    x = jnp.full(4, 4.0)
    state = balanced(params, Track.bump().astype(float64), x, folded)
    assert state.status[0] == Status.NO_SOLUTION
    finite_or_told(jax.tree.map(lambda leaf: leaf[1:], state))
    assert state.pose.status[3] == Status.OK
    np.testing.assert_allclose(state.pose.wheelbase[3], 1.4, rtol=1e-14)


@pytest.mark.parametrize("length", [0.1, 0.01, 1e-3])
def test_steps_sharper_than_the_wheel(float64, length):
    params, track = UGVParams(), Track.step(0.1, 4.0, length).astype(float64)
    x, angles = drawn(params, float64, 200, 3.0, 6.0)
    state = balanced(params, track, x, angles)
    finite_or_told(state)
    # At the foot of the step no wheel can touch, a fifth of a metre in three.
    told = {Status.HOLLOW_GROUND, Status.NOT_CONVERGED}
    lost = np.isin(np.asarray(state.pose.status), list(told))
    assert set(np.unique(state.pose.status)) <= told | {Status.OK}
    assert 0 < lost.mean() < 0.5


def test_a_track_of_a_million_points(float64):
    x = np.linspace(0.0, 1000.0, 1_000_001)
    track = Track.from_points(x, 0.05 * np.sin(x))
    params = UGVParams()
    where, angles = drawn(params, float64, 32, 10.0, 990.0)
    state = balanced(params, track, where, angles)
    wave = balanced(params, Track.sinusoid(0.05, 2 * np.pi).astype(float64), where, angles)
    np.testing.assert_allclose(state.pose.rear.x, wave.pose.rear.x, rtol=1e-11)
    np.testing.assert_allclose(state.torque, wave.torque, atol=1e-6 * params.weight)


def test_bad_members_of_a_batch_leave_the_others_alone(float64):
    params, track = UGVParams(), Track.bump().astype(float64)
    x, angles = drawn(params, float64, 8)
    bad = x.at[3].set(jnp.nan).at[5].set(jnp.inf)
    state, alone = balanced(params, track, bad, angles), balanced(params, track, x, angles)
    assert [int(s) for s in state.status[jnp.array([3, 5])]] == [Status.NON_FINITE] * 2
    others = np.array([0, 1, 2, 4, 6, 7])
    np.testing.assert_array_equal(state.torque[others], alone.torque[others])
