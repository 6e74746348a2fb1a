"""How the UGV's episodes end: failures terminate, the end of the track truncates."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Status
from stickslip.dynamics.ugv import PoseSolver, Track
from stickslip.envs import UGVEnv
from stickslip.envs.functional import pure_step
from tests.envs.ugv.helpers import actions, drive, task


def ending(status: Status):
    """Parameters under which a drive with the legs held ends in a status."""
    env, params = task(preview=0)
    cases = {
        Status.WHEEL_SLIP: lambda: params.replace(friction=0.05),
        Status.GROUNDED: lambda: params.replace(min_clearance=0.6),
        Status.ROLLOVER: lambda: env.make_params(
            track=Track.ramp(slope=2.5, position=3.5, joint=2.0, end=6.0), friction=20.0
        ),
        Status.HOLLOW_GROUND: lambda: env.make_params(
            track=Track.ramp(slope=1.0, position=3.0, joint=0.1, end=5.0), friction=20.0
        ),
    }
    return env, cases[status]()


def test_wheels_that_meet_end_the_episode():
    env, params = task(preview=0)
    inwards = -np.ones((int(params.steps), 2))
    run = drive(env, params, inwards)
    end = int(np.argmax(run.over))
    assert run.terminated[end]
    assert run.info["status"][end] == Status.OVERLAP
    assert run.reward[end] == -float(params.failure_penalty)
    reached = run.state.station.wheel_clearance
    assert 0 <= reached[end] == reached[end - 1]
    assert env.problem(run.first_state, params).min_wheel_clearance == 0
    again = drive(env, params.replace(vehicle=params.vehicle.replace(wheel_gap=0.1)), inwards)
    assert int(np.argmax(again.over)) < end


GROUNDS = [pytest.param(Status[n], marks=pytest.mark.long) for n in ("ROLLOVER", "HOLLOW_GROUND")]
"""Each a program of its own."""


@pytest.mark.parametrize("status", [Status.WHEEL_SLIP, Status.GROUNDED, *GROUNDS])
def test_what_the_model_does_not_cover_terminates(status):
    env, params = ending(status)
    run = drive(env, params, np.zeros((int(params.steps), 2)))
    assert run.over.any()
    end = int(np.argmax(run.over))
    assert run.info["status"][end] == status
    assert run.terminated[end]
    assert not run.truncated[end]
    assert run.reward[end] == -float(params.failure_penalty)
    assert not run.info["status"][:end].any()
    leaves = jax.tree.leaves((run.obs, run.state, run.info))
    assert all(np.isfinite(leaf[: end + 1]).all() for leaf in leaves if leaf.dtype.kind == "f")
    if end:  # frozen at the last good station
        assert run.state.station.x[end] == run.state.station.x[end - 1]
        assert run.state.station.status[end] == Status.OK
    else:  # begun outside the model
        assert run.state.station.x[0] == run.first_state.station.x
        assert run.first_state.station.status == status


def test_the_end_of_the_track_truncates():
    env, params = task()
    run = drive(env, params, actions(int(params.steps)))
    assert run.truncated.tolist() == [False] * (int(params.steps) - 1) + [True]
    assert not run.terminated.any()
    assert run.info["x"][-1] == pytest.approx(float(params.end), rel=1e-6)
    assert run.info["episode_length"][-1] == params.steps
    assert run.state.over[-1]


def test_an_action_that_is_no_number_ends_the_episode_with_finite_numbers():
    env, params = task()
    _, state = env.reset(jax.random.key(0), params)
    step = jax.jit(lambda given: pure_step(env, jax.random.key(0), state, given, params))
    obs, after, reward, terminated, _, info = step(jnp.asarray([jnp.nan, 0.0]))
    assert terminated
    assert info["status"] == Status.NON_FINITE
    assert np.isfinite(obs).all()
    assert reward == -params.failure_penalty
    assert np.array_equal(after.leg_angles, state.leg_angles)


def test_angles_stop_at_the_end_of_their_range():
    env, params = task()
    run = drive(env, params, np.ones((int(params.steps), 2)))
    high = np.float32(params.vehicle.leg_angle_max)
    assert run.state.leg_angles.max() == high
    first = run.state.leg_angles[0] - run.first_state.leg_angles
    np.testing.assert_allclose(first, float(params.leg_rate * params.spacing), rtol=1e-4)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: UGVEnv(criterion="speed"), r"criterion = 'speed' is unknown; accepted: 'wheel_"),
        (lambda: UGVEnv(preview=2.5), r"preview = 2\.5; accepted"),
        (lambda: UGVEnv().make_params(friction=-1.0), r"friction = -1\.0 is .* accepted: finite"),
        (lambda: UGVEnv().make_params(start=9.0), r"start = 9 m, end = 8 m; accepted: start < end"),
        (lambda: UGVEnv().make_params(track="bmp"), r"track = 'bmp' is unknown"),
        (lambda: UGVEnv().make_params(start_angles=(0.1, 1.0)), r"start_angles = 0\.1 rad"),
    ],
)
def test_bad_values_are_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.long
def test_a_pose_that_is_not_found_ends_the_episode():
    env = UGVEnv("wheel_energy", 0, PoseSolver(iterations=1, samples=4), "disabled")
    params = env.make_params(track=Track.sinusoid(0.1, 1.5, end=4.0), friction=20.0)
    run = drive(env, params, np.zeros((10, 2)))
    assert Status.NOT_CONVERGED in run.info["status"]
