"""The UGV's recommendations are the cheapest settings that promise what is asked, and hold it."""

import math
from itertools import product

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.ugv import Track, UGVParams, check_poses
from stickslip.dynamics.ugv.ground.roughness import Waves
from stickslip.dynamics.ugv.recommendation import (
    FAR,
    GROUNDS,
    MEASUREMENTS,
    NEAR,
    PLACES,
    Measurement,
    ground_of,
    place_of,
    recommend,
)

BATCHES = tuple(sorted({point.batch for point in MEASUREMENTS}))
TOLERANCES = tuple(10.0**k for k in range(-17, 0))
RADIUS = UGVParams().wheel_radius


def three_sines(x):
    return 0.05 * jnp.sin(2 * x + 0.3) + 0.02 * jnp.sin(5 * x + 1) + 0.006 * jnp.sin(9 * x + 2)


def as_waves(scale: float = 1.0) -> Track:
    """The three sines, all lengths scaled."""
    sizes, k = np.array([0.05, 0.02, 0.006]), np.array([2.0, 5.0, 9.0])
    shape = Waves(
        scale * sizes, k / (2 * np.pi * scale), np.array([0.3, 1.0, 2.0]) - np.pi / 2
    )  # fmt: skip
    return Track(shape, 0.0, 10.0 * scale)


def asked(tolerance: float, **options):
    """The recommendation, or None where it is refused."""
    try:
        return recommend(tolerance, **options)
    except ValueError:
        return None


def promised(point: Measurement) -> float:
    return max(point.torque.promised, point.contact.promised)


@pytest.mark.parametrize(
    ("kind", "tolerance"),
    [
        ("function", 1e-10),
        *(
            pytest.param(*case, marks=pytest.mark.long)
            for case in product(("waves", "function"), (1e-4, 1e-8, 1e-10))
            if case != ("function", 1e-10)
        ),
    ],
)
def test_what_is_recommended_on_three_sines_is_right_there(kind, tolerance):
    track = as_waves() if kind == "waves" else Track.from_function(three_sines, 0.0, 10.0)
    found = recommend(tolerance, 16384, track, checks=False)
    own = check_poses(found.setting, UGVParams(), track, count=200)
    assert own.wrong_statuses == 0
    assert own.compared == 200
    assert own.torque_error <= found.error <= tolerance
    assert own.contact_error <= found.error * RADIUS


@pytest.mark.parametrize("checks", [True, False])
@pytest.mark.parametrize("batch", BATCHES)
@pytest.mark.parametrize("ground", GROUNDS)
def test_no_measured_setting_is_cheaper_and_promises_enough(ground, batch, checks):
    points = [
        point
        for point in MEASUREMENTS
        if (point.ground, point.place, point.batch) == (ground, "near", batch)
        and (point.solver.samples > 0 or not checks)
        and point.pieces_per_wave is None
    ]
    answers = [asked(t, batch=batch, track=ground, checks=checks) for t in TOLERANCES]
    assert any(found is not None for found in answers)
    for tolerance, found in zip(TOLERANCES, answers, strict=True):
        good = [p for p in points if promised(p) <= tolerance]
        assert (found is None) == (not good)
        if found is not None:
            assert found.typical_error <= found.error <= min(found.worst_error, tolerance)
            assert found.cost == min(p.cost for p in good)
            assert found.setting.solver.samples > 0 or not checks
            assert found.setting.pieces is None


@pytest.mark.parametrize("dtype", [None, "float32", "float64"])
@pytest.mark.parametrize("ground", GROUNDS)
def test_a_looser_tolerance_never_costs_more(ground, dtype):
    for batch in BATCHES:
        answers = [asked(t, batch=batch, track=ground, dtype=dtype) for t in TOLERANCES]
        costs = [math.inf if found is None else found.cost for found in answers]
        assert costs == sorted(costs, reverse=True)
        assert dtype is None or all(f.setting.dtype == dtype for f in answers if f is not None)


def test_a_promise_names_its_sample():
    for ground in GROUNDS:
        found = recommend(1e-4, track=ground)
        assert found.poses >= 10_000
        assert found.quantile >= 0.99
        assert found.confidence >= 0.95
        assert found.wrong_rate == 3 / found.poses
        assert "wheel radii from the origin" in found.population
        assert found.ground == ground


def test_nothing_is_promised_by_a_number_of_iterations():
    # Newton's method alone cannot tell that it has arrived: its statuses were wrong in the sample.
    assert {point.solver.iterations for point in MEASUREMENTS} == {None}


def test_a_table_has_its_pieces_by_the_shortest_wave():
    found = {s: recommend(1e-5, 16384, as_waves(s), checks=False) for s in (1.0, 0.25)}
    pieces = [one.setting.pieces for one in found.values()]
    assert pieces[1] == pytest.approx(4 * pieces[0], abs=4)
    assert found[1.0].error == found[0.25].error
    assert recommend(1e-5, 16384, "waves", checks=False).setting.pieces is None


def test_a_tolerance_that_nothing_meets_is_refused_with_the_best_there_is():
    with pytest.raises(ValueError, match=r"tolerance = 1e-30 .* accepted: from [\d.e-]+ and"):
        recommend(1e-30, track="spline")
    with pytest.raises(ValueError, match="and 1e-40 m: no measured setting"):
        recommend(1e-2, contact_tolerance=1e-40, track="spline")


def test_the_contact_s_tolerance_is_in_metres_of_the_vehicle():
    loose = recommend(1e-3, batch=BATCHES[-1], contact_tolerance=0.1)
    tight = recommend(1e-3, batch=BATCHES[-1], contact_tolerance=1e-10)
    assert loose.cost <= tight.cost
    assert tight.error < 1e-3
    small = UGVParams(body_length=0.083, leg_length=0.035, wheel_radius=0.028)
    contact = 2e-5 * RADIUS
    assert recommend(1.0, dtype="float32", contact_tolerance=contact).setting.dtype == "float32"
    found = recommend(1.0, params=small, contact_tolerance=contact / 10, dtype="float32")
    assert found.error <= 2e-5
    with pytest.raises(ValueError, match="no measured setting"):
        recommend(1.0, contact_tolerance=contact / 10, dtype="float32")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"tolerance": 0.0}, "tolerance = 0.0"),
        ({"tolerance": math.nan}, "tolerance = nan"),
        ({"tolerance": "1e-3"}, "tolerance = '1e-3' is not a number"),
        ({"tolerance": 10**400}, "tolerance = .* is too large"),
        ({"batch": 0}, "batch = 0; accepted: an integer >= 1"),
        ({"batch": True}, "batch = True"),
        ({"track": "moon"}, "track = 'moon' is unknown; accepted: 'closed'"),
        ({"track": "wave"}, r"did you mean waves\?"),
        ({"track": None}, "track = None; accepted: a Track"),
        ({"params": 3}, "params = 3; accepted: UGVParams"),
        ({"dtype": "float16"}, "dtype = 'float16' is unknown"),
        ({"contact_tolerance": -1.0}, "contact_tolerance = -1.0"),
        ({"track": Track.bump(start=0.0, end=1e7)}, "wheel radii from the origin"),
    ],
)
def test_bad_questions_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        recommend(**{"tolerance": 1e-3, **arguments})


def test_nothing_is_promised_of_kinks():
    with pytest.raises(ValueError, match="track has straight pieces with kinks"):
        recommend(1e-3, track=Track.from_points([0.0, 1.0, 2.0], [0.0, 0.1, 0.0], "linear"))


def test_a_track_is_judged_by_how_its_ground_is_given_and_where():
    assert ground_of(Track.sinusoid()) == "closed"
    assert ground_of(Track.rough(3)) == "spline"
    assert ground_of(Track.from_points([0.0, 1.0, 2.0], [0.0, 0.1, 0.0])) == "spline"
    assert ground_of(Track.from_function(three_sines)) == "function"
    assert ground_of(as_waves()) == "waves"
    assert recommend(1e-3, track=Track.step()) == recommend(1e-3, track="closed")
    high = Track.from_points([0.0, 1.0, 2.0], [1500.0, 1500.1, 1500.0])
    assert [place_of(track, 0.28) for track in (Track.step(), high)] == list(PLACES)
    assert place_of(Track.bump(end=0.27 * NEAR), 0.28) == "near"
    assert place_of(Track.bump(end=0.27 * FAR), 0.28) == "far"
    with jax.enable_x64(True):
        assert place_of(high, 0.28) == "far"


def test_the_nearest_measured_batch_answers():
    assert recommend(1e-3, 2).batch == BATCHES[0]
    assert recommend(1e-3, 10**7).batch == BATCHES[-1]


def test_every_measurement_is_a_number_that_can_be_compared():
    for point in MEASUREMENTS:
        assert point.cost > 0
        assert 0 < point.torque.typical <= point.torque.promised <= point.torque.worst < math.inf
        assert 0 < point.contact.typical <= point.contact.promised <= point.contact.worst < math.inf
