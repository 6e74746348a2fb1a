"""check_poses measures what a setting does to the user's own poses, and says so."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.ugv import (
    PoseSolver,
    Setting,
    Track,
    UGVParams,
    check_poses,
    equilibrium,
)
from stickslip.dynamics.ugv.ground.spline import Spline
from stickslip.dynamics.ugv.recommendation import reach

BARE = PoseSolver(samples=0)
FIXED = PoseSolver(iterations=2, samples=0)


def three_sines(x):
    return 0.05 * jnp.sin(2 * x + 0.3) + 0.02 * jnp.sin(5 * x + 1) + 0.006 * jnp.sin(9 * x + 2)


SINES = Track.from_function(three_sines, 0.0, 10.0)


def test_the_default_setting_is_its_own_reference():
    found = check_poses(Setting(), UGVParams(), SINES, count=200)
    assert (found.torque_error, found.contact_error) == (0, 0)
    assert (found.count, found.compared, found.wrong_statuses, found.unseen) == (200, 200, 0, 0)
    assert min(found.cost, found.reference_cost) > 0


def test_iterations_that_cannot_tell_that_they_arrived_are_found_out():
    found = check_poses(Setting(FIXED, pieces=16), UGVParams(), SINES, count=200)
    assert found.wrong_statuses >= 30
    assert found.compared <= 200 - found.wrong_statuses
    assert 1e-9 < found.torque_error < 1e-6


def test_errors_are_those_of_the_equilibria_whatever_the_switch():
    params, setting = UGVParams(), Setting(BARE, "float32")
    random = np.random.default_rng(1)
    x = random.uniform(0, 10, 200)
    angles = random.uniform(params.leg_angle_min, params.leg_angle_max, (200, 2))
    narrow = equilibrium(
        params, SINES, *(np.asarray(v, np.float32) for v in (x, angles)), solver=BARE
    )
    with jax.enable_x64(True):
        wide = equilibrium(params, SINES, x, angles, solver=BARE)
        on = check_poses(setting, params, SINES, x, angles)
    off = check_poses(setting, params, SINES, x, angles)
    torque = np.abs(np.asarray(narrow.torque, float) - np.asarray(wide.torque))
    contact = np.abs(np.asarray(narrow.pose.rear.x, float) - np.asarray(wide.pose.rear.x))
    for found in (on, off):
        scale = params.weight * params.wheel_radius
        assert found.torque_error == pytest.approx(np.max(torque) / scale, rel=0.2)
        assert found.contact_error == pytest.approx(np.max(contact), rel=0.2)
        assert found.typical_contact_error == pytest.approx(np.median(contact), rel=0.2)
        assert found.compared == 200
        place = int(np.argmin(np.abs(x - found.worst[0])))
        assert found.worst == (x[place], *angles[place])


def test_poses_that_an_unchecked_setting_cannot_judge_are_counted():
    track = Track.step(height=0.3, length=0.4, position=4.0, start=3.0, end=6.0)
    blind = check_poses(Setting(BARE), UGVParams(), track, count=300)
    seeing = check_poses(Setting(), UGVParams(), track, count=300)
    assert blind.unseen > 10
    assert seeing.unseen == 0
    assert blind.wrong_statuses == seeing.wrong_statuses == 0


def test_places_and_angles_broadcast():
    found = check_poses(
        Setting(BARE), UGVParams(), SINES, np.linspace(2.0, 7.0, 5)[:, None], np.full((3, 2), 1.5)
    )
    assert found.count == 15


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"setting": "fast"}, "setting = 'fast'; accepted: a Setting"),
        ({"params": None}, "params = None; accepted: UGVParams"),
        ({"track": "bmp"}, "track = 'bmp' is unknown"),
        ({"x_front": 1.0}, "accepted: both, or neither"),
        ({"x_front": "1", "leg_angles": [1.5, 1.5]}, "x_front = '1' is not a number"),
        ({"x_front": [1.0, math.nan], "leg_angles": [1.5, 1.5]}, "x_front = nan"),
        ({"x_front": [1.0, 2.0], "leg_angles": np.full((3, 2), 1.5)}, "has shape"),
        ({"x_front": 1.0, "leg_angles": [9.0, 1.5]}, "leg_angles = 9 rad"),
        ({"count": 0}, "count = 0; accepted: an integer >= 1"),
        ({"count": 10**15}, "count = 1000000000000000 makes 1e[+]15 poses"),
        ({"seed": -1}, "seed = -1"),
        ({"friction": None}, "friction = None is not a number"),
    ],
)
def test_bad_questions_are_refused(options, message):
    given = {"setting": Setting(), "params": UGVParams(), "track": SINES} | options
    with pytest.raises(ValueError, match=message):
        check_poses(**given)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"solver": "newton"}, "solver = 'newton'; accepted: a PoseSolver"),
        ({"solver": None}, "solver = None; accepted: a PoseSolver"),
        ({"dtype": "bfloat16"}, "dtype = 'bfloat16' is unknown"),
        ({"dtype": "float46"}, r"did you mean float\d\d\?"),
        ({"dtype": np.float32}, "dtype = .* is unknown"),
        ({"pieces": 0}, "pieces = 0; accepted: None, or an integer"),
        ({"pieces": 2.5}, "pieces = 2.5"),
        ({"pieces": "8"}, "pieces = '8'"),
        ({"pieces": b"8"}, "pieces = b'8'"),
        ({"pieces": [8]}, r"pieces = \[8\]"),
        ({"pieces": True}, "pieces = True"),
        ({"pieces": math.inf}, "pieces = inf"),
    ],
)
def test_a_setting_refuses_what_it_does_not_know(options, message):
    with pytest.raises(ValueError, match=message):
        Setting(**options)


@pytest.mark.parametrize("pieces", [10**12, 10**400])
def test_a_table_that_does_not_fit_is_refused_before_it_is_made(float64, pieces):
    with pytest.raises(ValueError, match=r"pieces of a table, about .* bytes; accepted: what"):
        Setting(pieces=pieces).prepared(Track.bump())


def test_a_setting_prepares_a_track_once(float64):
    setting = Setting(pieces=4)
    table = setting.prepared(Track.bump())
    assert isinstance(table.shape, Spline)
    again = setting.prepared(table)
    np.testing.assert_array_equal(again.shape.coefficients, table.shape.coefficients)
    assert Setting(dtype="float32").prepared(Track.bump()).shape.height.dtype == np.float32
    with pytest.raises(ValueError, match="track = 'bmp' is unknown"):
        setting.prepared("bmp")


@pytest.mark.parametrize(
    "params",
    [
        pytest.param(UGVParams(), marks=pytest.mark.long),
        UGVParams(body_length=4.0, leg_length=1.5, wheel_radius=1.2),
    ],
)
def test_a_table_holds_the_whole_vehicle_at_both_ends(float64, params: UGVParams):
    track = Track.sinusoid(amplitude=0.1, wavelength=3.0)
    table = Setting(pieces=64).prepared(track, params)
    x = np.array([track.start - reach(params), track.end + reach(params)])
    np.testing.assert_allclose(table.height(x), track.height(x), atol=1e-9)


@pytest.mark.long
def test_a_table_in_single_precision_is_as_good_as_its_numbers():
    x = np.linspace(0.0, 8.0, 101, dtype=np.float32)
    narrow = Setting(dtype="float32", pieces=16).prepared(Track.bump())
    with jax.enable_x64(True):
        curvature = Setting(pieces=16).prepared(Track.bump()).profile(x.astype(float))[2]
    # Built in single precision, rounding over h^2 would show.
    np.testing.assert_allclose(narrow.profile(x)[2], curvature, atol=2e-5)
    with pytest.raises(ValueError, match="without jax_enable_x64"):
        Setting().prepared(Track.bump())
