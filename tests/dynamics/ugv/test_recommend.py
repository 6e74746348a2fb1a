"""Recommendations are the cheapest settings that keep a promise."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.ugv import Track, UGVParams, equilibrium, recommendation
from stickslip.dynamics.ugv.ground.roughness import Waves

BATCHES = tuple(sorted({point.batch for point in recommendation.promises()}))
TOLERANCES = tuple(10.0**k for k in range(-17, 0))


def three_sines(x):
    return 0.05 * jnp.sin(2 * x + 0.3) + 0.02 * jnp.sin(5 * x + 1) + 0.006 * jnp.sin(9 * x + 2)


SINES = Track.from_function(three_sines, 0.0, 10.0)


def as_waves() -> Track:
    """The three sines as waves."""
    sizes, k = np.array([0.05, 0.02, 0.006]), np.array([2.0, 5.0, 9.0])
    return Track(Waves(sizes, k / (2 * np.pi), np.array([0.3, 1.0, 2.0]) - np.pi / 2), 0.0, 10.0)


def asked(tolerance: float, **options):
    """The recommendation, or None where it is refused."""
    try:
        return recommendation.recommend(tolerance, **options)
    except ValueError:
        return None


@pytest.mark.parametrize(
    ("kind", "tolerance"),
    [("function", 1e-10), pytest.param("waves", 1e-4, marks=pytest.mark.long)],
)
def test_what_is_recommended_on_three_sines_is_right_there(kind, tolerance):
    track = as_waves() if kind == "waves" else SINES
    found = recommendation.recommend(tolerance, 16384, track, checks=False)
    params = UGVParams()
    random = np.random.default_rng(0)
    x = random.uniform(0, 10, 200)
    angles = random.uniform(params.leg_angle_min, params.leg_angle_max, (200, 2))
    with jax.enable_x64(True):
        truth = equilibrium(params, track.astype("float64"), x, angles)
        given = (jnp.asarray(v, found.dtype) for v in (x, angles))
        own = equilibrium(params, track.astype(found.dtype), *given, solver=found.solver)
    np.testing.assert_array_equal(own.status, truth.status)
    torque, contact = (
        np.max(np.abs(np.asarray(one, float) - np.asarray(other, float)))
        for one, other in ((own.torque, truth.torque), (own.pose.rear.x, truth.pose.rear.x))
    )
    assert torque / (params.weight * params.wheel_radius) <= found.promised_error <= tolerance
    assert contact <= found.promised_error * params.wheel_radius


@pytest.mark.parametrize("checks", [True, False])
@pytest.mark.parametrize("ground", recommendation.GROUNDS)
def test_no_measured_setting_is_cheaper_and_promises_enough(ground, checks):
    for batch in BATCHES:
        points = [
            point
            for point in recommendation.promises()
            if (point.ground, point.place, point.batch) == (ground, "near", batch)
            and (point.solver.samples > 0 or not checks)
        ]
        answers = [asked(t, batch=batch, track=ground, checks=checks) for t in TOLERANCES]
        assert any(found is not None for found in answers)
        for tolerance, found in zip(TOLERANCES, answers, strict=True):
            good = [p for p in points if p.promised_error <= tolerance]
            assert (found is None) == (not good)
            if found is not None:
                most = min(found.worst_error, tolerance)
                assert found.typical_error <= found.promised_error <= most
                assert found.cost == min(p.cost for p in good)


def test_a_promise_names_its_sample_and_its_batch():
    for ground in recommendation.GROUNDS:
        found = recommendation.recommend(1e-4, track=ground, dtype="float64")
        assert found.poses >= 10_000
        assert found.quantile >= 0.99
        assert (found.ground, found.dtype) == (ground, "float64")
    assert recommendation.recommend(1e-3, 2).batch == BATCHES[0]
    assert recommendation.recommend(1e-3, 10**7).batch == BATCHES[-1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"tolerance": 0.0}, "tolerance = 0.0"),
        ({"tolerance": "1e-3"}, "tolerance = '1e-3' is not a number"),
        ({"tolerance": 1e-30}, r"tolerance = 1e-30: no measured .* accepted: from "),
        ({"batch": 0}, "batch = 0; accepted: an integer >= 1"),
        ({"track": "wave"}, r"did you mean waves\?"),
        ({"track": None}, "track = None; accepted: a Track"),
        ({"params": 3}, "params = 3; accepted: UGVParams"),
        ({"dtype": "float16"}, "dtype = 'float16' is unknown"),
        ({"track": Track.bump(start=0.0, end=1e7)}, "wheel radii from the origin"),
        ({"track": Track.from_points([0.0, 1.0, 2.0], [0.0, 0.1, 0.0], "linear")}, "kinks"),
    ],
)
def test_bad_questions_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        recommendation.recommend(**{"tolerance": 1e-3, **arguments})


def test_a_track_is_judged_by_how_its_ground_is_given_and_where():
    assert recommendation.ground_of(Track.sinusoid()) == "closed"
    assert recommendation.ground_of(Track.rough(3)) == "spline"
    assert recommendation.ground_of(SINES) == "function"
    assert recommendation.ground_of(as_waves()) == "waves"
    step, closed = (recommendation.recommend(1e-3, track=of) for of in (Track.step(), "closed"))
    assert step == closed
    high = Track.from_points([0.0, 1.0, 2.0], [1500.0, 1500.1, 1500.0])
    places = [recommendation.place_of(track, 0.28) for track in (Track.step(), high)]
    assert places == ["near", "far"]
    assert recommendation.place_of(Track.bump(end=0.27 * recommendation.NEAR), 0.28) == "near"
    assert recommendation.place_of(Track.bump(end=0.27 * recommendation.FAR), 0.28) == "far"
