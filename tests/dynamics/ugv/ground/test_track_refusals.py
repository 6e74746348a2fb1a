"""Tracks that make no sense are refused, with what was given and what is accepted."""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.ugv.ground.roughness import (
    rough_shape,
)
from stickslip.dynamics.ugv.ground.spline import INTERPOLATIONS
from stickslip.dynamics.ugv.track import Track


def hills(x):
    return 0.1 * jnp.sin(x) + 0.02 * x


# Refusals


def refused(*parts):
    return pytest.raises(ValueError, match=".*".join(map(re.escape, parts)))


@pytest.mark.parametrize(
    ("x", "y", "parts"),
    [
        ([0, 1, 1, 2], [0, 0, 0, 0], ("x[2] = 1.0 repeats x[1] = 1.0", "strictly increasing")),
        ([0, 2, 1], [0, 0, 0], ("x[2] = 1.0 is less than x[1] = 2.0", "strictly increasing")),
        ([0, np.nan, 2], [0, 0, 0], ("x[1] = nan", "finite")),
        ([0, 1, 2], [0, 0, np.inf], ("y[2] = inf", "finite")),
        ([0, 1, 2], [0, 0], ("x has 3 points and y 2", "as many")),
        ([0], [0], ("x has shape (1,)", "at least 2 points")),
        ([], [], ("x has shape (0,)", "at least 2 points")),
        ([[0, 1], [2, 3]], [0, 1], ("x has shape (2, 2)", "one axis")),
        (["a", "b"], [0, 1], ("x = ", "are no numbers", "accepted")),
        ([0, 1e-300], [0, 1e10], ("overflows float64", "farther apart")),
    ],
)
def test_points_that_make_no_track_are_refused(x, y, parts):
    for kind in INTERPOLATIONS:
        with refused(*parts):
            Track.from_points(x, y, kind)


def test_traced_points_are_refused_but_two_points_are_a_line():
    with refused("traced", "concrete points"):
        jax.jit(lambda y: Track.from_points(np.arange(3.0), y).height(0.5))(jnp.zeros(3))
    for kind in INTERPOLATIONS:
        line = Track.from_points([0.0, 2.0], [1.0, 2.0], kind)
        np.testing.assert_allclose(
            line.height(jnp.asarray([-2.0, 1.0, 4.0])), [0, 1.5, 3], atol=1e-6
        )


@pytest.mark.parametrize(
    ("function", "parts"),
    [
        (3.0, ("function = 3.0 cannot be called", "accepted")),
        (lambda x: jnp.stack([x, x]), ("function(0) has shape (2,)", "one number")),
        (lambda x: 1 / (x - 5), ("height of function at x = 5 is inf", "finite")),
        (lambda x: jnp.sqrt(x), ("slope of function at x = 0 is inf", "finite")),
        (lambda x: x**1.5, ("second derivative of function at x = 0", "finite")),
        (lambda x, y: x, ("function(0) fails", "one number")),
        (lambda x: np.sin(x), ("function(0) fails", "jax.numpy")),
        (lambda x: x if x < 5 else 2 * x - 5, ("function(0) fails", "boolean", "jax.numpy")),
        (lambda x: "high", ("function(0) fails", "jax.numpy")),
    ],
)
def test_functions_that_make_no_track_are_refused(function, parts):
    with refused(*parts):
        Track.from_function(function)


def test_a_function_without_hash_is_refused():
    class Unhashable:
        __hash__ = None

        def __call__(self, x):
            return x

    with refused("has no hash", "hashable"):
        Track.from_function(Unhashable())


@pytest.mark.parametrize(
    ("make", "parts"),
    [
        (lambda: Track.named("hill"), ("name = 'hill'", "'bump'")),
        (lambda: Track.named("bump", depth=1.0), ("'depth' is no argument", "height, centre")),
        (lambda: Track.bump(width=0.0), ("width = 0.0", "length > 0")),
        (lambda: Track.step(height=np.nan), ("height = nan", "finite")),
        (lambda: Track.flat(start=3.0, end=3.0), ("start = 3.0, end = 3.0", "start < end")),
        (lambda: Track.from_function(hills, end=np.inf), ("end = inf", "finite")),
        (lambda: Track.rough(0, "J"), ("iso_class = 'J'", "'H'")),
        (lambda: Track.rough(0, margin=-1.0), ("margin = -1.0", ">= 0")),
        (lambda: Track.rough(0, band=(1.0, 0.1)), ("band = (1.0, 0.1)", "low < high")),
        (lambda: Track.rough(0, waves=0), ("waves = 0", ">= 1")),
        (lambda: rough_shape(jax.random.key(0), -1.0), ("roughness = -1.0", ">= 0")),
        (lambda: Track.flat().resampled(0.0, 1.0, 2.5), ("pieces = 2.5", "integer >= 1")),
        (lambda: Track.flat().resampled(1.0, 0.0, 5), ("start = 1.0, end = 0.0", "start < end")),
        (lambda: Track.from_points([0, 1], [0, 1], "spline"), ("= 'spline'", "'pchip'")),
    ],
)  # fmt: skip
def test_numbers_that_make_no_track_are_refused(make, parts):
    with refused(*parts):
        make()
