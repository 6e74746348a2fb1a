"""The UGV's recommendations are the cheapest measured points that do what is asked."""

import math

import jax
import numpy as np
import pytest

from stickslip.dynamics.ugv import PoseSolver, Track, UGVParams, equilibrium
from stickslip.dynamics.ugv.settings import (
    MEASUREMENTS,
    TRACKS,
    WHEEL_RADIUS,
    Measurement,
    Setting,
    recommend,
    track_class,
)
from stickslip.dynamics.ugv.spline import Spline

BATCHES = tuple(sorted({point.batch for point in MEASUREMENTS}))
TOLERANCES = tuple(10.0**k for k in range(-17, 0))


def asked(tolerance: float, **options):
    """The recommendation, or None where it is refused."""
    try:
        return recommend(tolerance, **options)
    except ValueError:
        return None


def in_question(track: str, batch: int, checks: bool) -> list[Measurement]:
    return [
        point
        for point in MEASUREMENTS
        if (point.track, point.batch) == (track, batch)
        and (point.setting.solver.samples > 0 or not checks)
    ]


@pytest.mark.parametrize("checks", [True, False])
@pytest.mark.parametrize("batch", BATCHES)
@pytest.mark.parametrize("track", TRACKS)
def test_no_measured_setting_is_cheaper_and_good_enough(track, batch, checks):
    points = in_question(track, batch, checks)
    answers = [asked(t, batch=batch, track=track, checks=checks) for t in TOLERANCES]
    assert any(found is not None for found in answers)
    for tolerance, found in zip(TOLERANCES, answers, strict=True):
        good = [p for p in points if p.error <= tolerance]
        assert (found is None) == (not good)
        if found is not None:
            assert found.error <= tolerance
            assert found.cost == min(p.cost for p in good)
            assert found.setting.solver.samples > 0 or not checks


@pytest.mark.parametrize("dtype", [None, "float32", "float64"])
@pytest.mark.parametrize("track", TRACKS)
def test_a_looser_tolerance_never_costs_more(track, dtype):
    for batch in BATCHES:
        answers = [asked(t, batch=batch, track=track, dtype=dtype) for t in TOLERANCES]
        costs = [math.inf if found is None else found.cost for found in answers]
        assert costs == sorted(costs, reverse=True)
        assert dtype is None or all(f.setting.dtype == dtype for f in answers if f is not None)


def test_a_tolerance_that_nothing_meets_is_refused_with_the_best_there_is():
    with pytest.raises(ValueError, match=r"tolerance = 1e-30 .* accepted: from [\d.e-]+ and"):
        recommend(1e-30, track="rough")
    with pytest.raises(ValueError, match="and 1e-40 m: no measured setting"):
        recommend(1e-2, contact_tolerance=1e-40, track="rough")


def test_the_contact_has_its_own_tolerance_where_one_is_given():
    loose = recommend(1e-3, batch=BATCHES[-1], contact_tolerance=0.1)
    tight = recommend(1e-3, batch=BATCHES[-1], contact_tolerance=1e-10)
    assert loose.cost <= tight.cost
    assert tight.error < 1e-3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"tolerance": 0.0}, "tolerance = 0.0"),
        ({"tolerance": math.nan}, "tolerance = nan"),
        ({"tolerance": 1e-3, "batch": 0}, "batch = 0; accepted: an integer >= 1"),
        ({"tolerance": 1e-3, "batch": True}, "batch = True"),
        ({"tolerance": 1e-3, "track": "moon"}, "track = 'moon' is unknown; accepted: 'bump'"),
        ({"tolerance": 1e-3, "track": None}, "track = None; accepted: a Track"),
        ({"tolerance": 1e-3, "dtype": "float16"}, "dtype = 'float16' is unknown"),
        ({"tolerance": 1e-3, "contact_tolerance": -1.0}, "contact_tolerance = -1.0"),
    ],
)
def test_bad_questions_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        recommend(**arguments)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"solver": "newton"}, "solver = 'newton'; accepted: a PoseSolver"),
        ({"dtype": "bfloat16"}, "dtype = 'bfloat16' is unknown"),
        ({"pieces": 0}, "pieces = 0; accepted: None, or an integer"),
        ({"pieces": 2.5}, "pieces = 2.5"),
    ],
)
def test_a_setting_refuses_what_it_does_not_know(options, message):
    with pytest.raises(ValueError, match=message):
        Setting(**options)


def test_a_track_is_judged_by_how_its_ground_is_given():
    assert track_class(Track.sinusoid()) == "bump"
    assert track_class(Track.rough(3)) == "rough"
    assert track_class(Track.from_points([0.0, 1.0, 2.0], [0.0, 0.1, 0.0])) == "rough"
    assert recommend(1e-3, track=Track.step()) == recommend(1e-3, track="bump")


def test_the_nearest_measured_batch_answers():
    assert recommend(1e-3, 2).batch == BATCHES[0]
    assert recommend(1e-3, 10**7).batch == BATCHES[-1]


def test_a_setting_prepares_a_track_once(float64):
    setting = Setting(pieces=4)
    table = setting.prepared(Track.bump())
    assert isinstance(table.shape, Spline)
    assert table.shape.coefficients.shape == (48, 6)
    assert setting.prepared(table).shape.coefficients.shape == (48, 6)
    assert Setting(dtype="float32").prepared(Track.bump()).shape.height.dtype == np.float32


def test_a_table_in_single_precision_is_as_good_as_its_numbers():
    x = np.linspace(0.0, 8.0, 101, dtype=np.float32)
    narrow = Setting(dtype="float32", pieces=16).prepared(Track.bump())
    with jax.enable_x64(True):
        curvature = Setting(pieces=16).prepared(Track.bump()).profile(x.astype(float))[2]
    # Built in single precision, rounding over h^2 would show.
    np.testing.assert_allclose(narrow.profile(x)[2], curvature, atol=2e-5)
    with pytest.raises(ValueError, match="without jax_enable_x64"):
        Setting().prepared(Track.bump())


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7])
def test_the_recommended_setting_meets_its_tolerance_on_other_postures(tolerance):
    params = UGVParams()
    random = np.random.default_rng(5)
    x = random.uniform(2.0, 7.5, 256)
    angles = random.uniform(params.leg_angle_min, params.leg_angle_max, (256, 2))
    found = recommend(tolerance, batch=BATCHES[-1], track="rough", checks=False).setting
    with jax.enable_x64(True):
        truth = equilibrium(params, Track.bump(), x, angles, solver=PoseSolver(samples=0))
        wanted = np.asarray(truth.torque), np.asarray(truth.pose.rear.x)
        status = np.asarray(truth.status)
    with jax.enable_x64(found.dtype == "float64"):
        x, angles = (np.asarray(v, found.dtype) for v in (x, angles))
        track = found.prepared(Track.bump())
        got = equilibrium(params, track, x, angles, solver=found.solver)
        torque, contact = np.asarray(got.torque), np.asarray(got.pose.rear.x)
    np.testing.assert_array_equal(np.asarray(got.status), status)
    scale = float(params.weight * params.wheel_radius)
    assert 0 < np.max(np.abs(torque - wanted[0])) <= tolerance * scale
    assert 0 < np.max(np.abs(contact - wanted[1])) <= tolerance * WHEEL_RADIUS


def test_the_measured_vehicle_is_the_default():
    assert UGVParams().wheel_radius == WHEEL_RADIUS


def test_every_measurement_is_a_number_that_can_be_compared():
    for point in MEASUREMENTS:
        assert point.cost > 0
        assert 0 <= point.error < math.inf
