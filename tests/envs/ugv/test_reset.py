"""What the UGV observes, and what a reset draws from its key."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.ugv import Odometer
from stickslip.envs import RandomTrack, UGVEnv, UGVRandomisation
from tests.envs.ugv.helpers import actions, drive, task

pytestmark = pytest.mark.long


def resets(env, params, count: int = 64):
    keys = jax.random.split(jax.random.key(3), count)
    return jax.jit(jax.vmap(env.reset_env, (0, None)))(keys, params)


def test_a_reset_draws_everything_within_its_range_and_the_same_again():
    env, params = task("random")
    obs, states = resets(env, params)
    again = resets(env, params)
    assert jax.tree.all(jax.tree.map(np.array_equal, (obs, states), again))
    friction, angles = states.drawn.friction, states.leg_angles
    assert 0.005 <= friction.min() < 0.03
    assert 0.18 < friction.max() <= 0.2
    assert 1.0 <= angles.min() < 1.1
    assert 1.9 < angles.max() <= 2.0
    assert len(np.unique(np.asarray(angles))) == 128  # each leg its own
    assert np.array_equal(states.station.friction, friction)
    height = np.asarray(jax.vmap(lambda o: o.track.height(2.75))(states.drawn.odometer))
    assert len(np.unique(height)) == 64
    assert 0.1 < height.max() < 0.3


def test_what_is_not_randomised_is_not_drawn():
    env, params = task()
    _, state = env.reset(jax.random.key(0), params)
    assert state.drawn == (None, None, None)
    np.testing.assert_array_equal(state.leg_angles, params.start_angles)


def test_drawn_bumps_are_exact_and_drawn_ground_is_consistent_with_its_odometer(float64):
    ranges = RandomTrack(bump_height=(0.1, 0.2), bump_width=(1.0, 1.0), bump_centre=(4.0, 4.0))
    drawn = ranges.draw(jax.random.key(0), jnp.asarray(0.0), jnp.asarray(8.0), jnp.float64)
    height = float(drawn.track.height(jnp.asarray(4.0)))
    assert 0.1 <= height <= 0.2
    assert drawn.track.height(jnp.asarray(5.0)) == pytest.approx(height * np.exp(-1))
    fine = Odometer.along(drawn.track, 0.0, 8.0, 400)
    x = jnp.linspace(0.3, 7.7, 9)
    np.testing.assert_allclose(drawn.distance(x), fine.distance(x), rtol=1e-8)


def test_the_preview_shows_the_ground_ahead_in_wheel_radii():
    env, params = task(preview=4)
    run = drive(env, params, np.zeros((3, 2)))
    x = run.state.station.x[1]
    track, r = params.track, float(params.vehicle.wheel_radius)
    ahead = x + float(params.preview_length) * np.asarray([0.25, 0.5, 0.75, 1.0])
    expected = (track.height(ahead) - track.height(jnp.asarray(x))) / r
    np.testing.assert_allclose(run.obs[1, -4:], expected, atol=1e-5)
    assert env.reset(jax.random.key(0), params)[0].shape == (8 + 4,)


def test_the_previews_noise_has_the_size_asked_for_and_differs_in_every_step():
    env, params = task("random", preview=3)
    given = np.zeros((8, 2))
    noisy = [drive(env, params.replace(preview_noise=noise), given, 1).obs for noise in (0.02, 0.0)]
    error = (noisy[0] - noisy[1])[:, -3:] * float(params.vehicle.wheel_radius)
    assert 0.01 < error.std() < 0.04
    assert len(np.unique(error.round(6))) == error.size
    np.testing.assert_array_equal(noisy[0][:, :-3], noisy[1][:, :-3])


@pytest.mark.parametrize("criterion", ["wheel_energy", "grip"])
def test_observations_stay_inside_the_bounds(criterion):
    env, params = task("random", criterion=criterion)
    low, high = env.observation_bounds(params)
    assert np.isfinite([low, high]).all()
    for seed in range(3):
        run = drive(env, params, actions(int(params.steps), seed), seed)
        assert run.obs.shape[1] == len(low)
        assert (run.obs >= low).all()
        assert (run.obs <= high).all()


@pytest.mark.parametrize(
    ("ranges", "message"),
    [
        (UGVRandomisation(friction=(1.0, 0.5)), r"friction = \(1\.0, 0\.5\) has low > high"),
        (UGVRandomisation(start_angles=(0.1, 1.0)), r"start_angles = 0\.1 rad"),
        (UGVRandomisation(RandomTrack()), r"bump_height and roughness are None"),
        (UGVRandomisation(RandomTrack((0.0, 0.1), waves=0)), r"waves = 0; accepted: an integer"),
    ],
)
def test_bad_ranges_are_named(ranges, message):
    with pytest.raises(ValueError, match=message):
        UGVEnv().make_params(randomisation=ranges)
