"""What makes no vehicle, ground or solver is refused, with what was given and what is accepted."""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.ugv import Odometer, PoseSolver, Track, UGVParams, pose

X, ANGLES = 4.0, np.array([1.5, 1.5])
FLAT, PARAMS = Track.flat(), UGVParams()


def test_ground_too_long_is_refused_before_it_is_made():
    for make in (
        lambda: Track.rough(end=1e12),
        lambda: Odometer.along(Track.from_points([0.0, 1e12], [0.0, 0.0])),
        lambda: Odometer.along(Track.flat(end=1e12)),
    ):
        with pytest.raises(ValueError, match=r"end - start = 1e\+.*STICKSLIP_MEMORY_LIMIT"):
            make()


class Unhashable:
    """A function that JAX cannot look up."""

    __hash__ = None

    def __call__(self, x):
        return x


@pytest.mark.parametrize(
    ("make", "parts"),
    [
        (lambda: Track.named("bumb"), ("did you mean bump",)),
        (lambda: Track.named("bump", depth=1.0), ("'depth' is no argument", "height, centre")),
        (lambda: Track.bump(width=0.0), ("width = 0.0", "length > 0")),
        (lambda: Track.flat(start=3.0, end=3.0), ("start = 3.0, end = 3.0", "start < end")),
        (lambda: FLAT.resampled(1.0, 0.0, 5), ("start = 1.0, end = 0.0", "start < end")),
        (lambda: Odometer.along(FLAT, 8.0), ("start = 8.0, end = 8.0", "start < end")),
        (lambda: Track.rough("seed"), ("key = 'seed'",)),
        (lambda: Track.rough(0, "J"), ("iso_class = 'J'", "'H'")),
        (lambda: PoseSolver("newtn"), ("did you mean newton",)),
        (lambda: PoseSolver("scan", samples=0), ("samples = 0",)),
        (lambda: pose(None, FLAT, X, ANGLES), ("params = None",)),
        (lambda: pose(PARAMS, FLAT, X, ANGLES, solver="newton"), ("solver = 'newton'",)),
        (lambda: pose(PARAMS, FLAT, X, [0.1, 1.5]), ("leg_angles = 0.1 rad",)),
        (lambda: pose(PARAMS, FLAT, X, [1.5]), ("leg_angles has shape (1,)",)),
        (lambda: pose(PARAMS, FLAT, np.ones(3), np.ones((4, 2))), ("x_front (3,)",)),
        (lambda: Track.from_function(3.0), ("function = 3.0 fails: ", "not callable", "accepted")),
        (lambda: Track.from_function(Unhashable()), ("fails: unhashable", "hashable")),
        (
            lambda: Track.from_function(lambda x: jnp.stack([x, x])),
            ("has shape (2,)", "one number"),
        ),
        (lambda: Track.from_function(lambda x: 1 / (x - 5)), ("height", "x = 5 is inf")),
        (lambda: Track.from_function(lambda x: jnp.sqrt(x)), ("slope", "x = 0 is inf")),
        (lambda: Track.from_function(lambda x: np.sin(x)), ("fails", "jax.numpy")),
        (lambda: Track.from_points([0, 1], [0, 1], "spline"), ("= 'spline'", "'pchip'")),
        (lambda: Track.from_points([0, 1, 1], [0] * 3), ("x[2] = 1.0 after 1.0", "strictly")),
        (lambda: Track.from_points([0, 2, 1], [0] * 3), ("x[2] = 1.0 after 2.0",)),
        (lambda: Track.from_points([0, np.nan], [0, 0]), ("x[1] = nan", "finite")),
        (lambda: Track.from_points([0, 1, 2], [0, 0]), ("x has 3 points and y 2", "as many")),
        (lambda: Track.from_points([0], [0]), ("x has shape (1,)", "at least 2 points")),
        (lambda: Track.from_function(lambda x: x if x < 5 else 2 * x), ("fails", "boolean")),
        (lambda: Track.from_points([0, 1e-300], [0, 1e10]), ("overflows float64", "apart")),
        (
            lambda: jax.jit(lambda y: Track.from_points(np.arange(3.0), y).end)(jnp.zeros(3)),
            ("traced", "concrete points"),
        ),
    ],
)
def test_other_refusals_say_what_is_accepted(make, parts):
    with pytest.raises(ValueError, match=".*".join(map(re.escape, parts))) as caught:
        make()
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"wheel_radius": -0.28}, "-0.28"),
        ({"leg_length": 0.5}, "body_length"),
        ({"wheel_gap": -0.01}, "wheel_gap"),
        ({"leg_angle_min": 2.0, "leg_angle_max": 1.0}, "leg_angle_min"),
        ({"leg_angle_max": 4.0}, "leg_angle_max"),
        ({"wheel_mass": 0.0, "body_mass": 0.0, "leg_mass": 0.0}, "all 0"),
    ],
)
def test_vehicles_that_cannot_be_are_refused(values, named):
    with pytest.raises(ValueError, match=rf"{named}.*accepted"):
        UGVParams(**values)


def test_lists_of_numbers_are_taken_where_arrays_are():
    listed = pose(PARAMS, FLAT, [3.0, 4.0], [1.5, 1.5])
    given = pose(PARAMS, FLAT, np.array([3.0, 4.0]), np.array([1.5, 1.5]))
    np.testing.assert_array_equal(listed.rear.x, given.rear.x)
