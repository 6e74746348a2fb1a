"""Enclosures hold the ground, its derivatives and its arc length."""

import jax
import numpy as np
import pytest

from stickslip.dynamics.ugv import Odometer, Track
from stickslip.optim import PostureProblem, solve
from stickslip.optim.intervals import Interval, interval
from stickslip.optim.posture.bounds.ground import Arc, ground_of

RANDOM = np.random.default_rng(5)
POINTS = (np.linspace(0, 9, 13), 0.1 * RANDOM.standard_normal(13))
TRACKS = {
    "flat": Track.flat,
    "incline": Track.incline,
    "bump": lambda: Track.bump(0.3, 4.0, 0.7),
    "sinusoid": Track.sinusoid,
    "ramp": Track.ramp,
    "step": Track.step,
    "ditch": lambda: Track.ditch(side=1.4),
    "rough": lambda: Track.rough(1, "E", end=8.0),
    "cubic": lambda: Track.from_points(*POINTS),
    "pchip": lambda: Track.from_points(*POINTS, "pchip"),
    "linear": lambda: Track.from_points(*POINTS, "linear"),
}


@pytest.mark.parametrize("name", TRACKS)
def test_profiles_are_held_over_wide_and_narrow_intervals(name: str, float64):
    track, random = TRACKS[name](), np.random.default_rng(0)
    ground = ground_of(track.shape)
    middle, half = random.uniform(-3, 12, 2000), 10 ** random.uniform(-14, -0.3, 2000)
    x = Interval(middle - half, middle + half)
    found = ground.profile(x)
    with jax.enable_x64(True):
        places = (middle + share * half for share in (-1, -0.3, 0, 1))
        at = [[np.asarray(of) for of in track.profile(x)] for x in places]
    for values in at:
        for interval_, value in zip(found, values, strict=False):
            slack = 1e-12 * (1 + np.abs(value))  # of the computed values themselves
            assert np.all((interval_.lo - slack <= value) & (value <= interval_.hi + slack))
    if not len(ground.kinks) and not len(ground.bends):
        slope = (at[3][2] - at[0][2]) / (x.hi - x.lo)  # a mean of the third derivative
        slack = 1e-11 * (1 + np.abs(found[2].size)) / half
        assert np.all((found[3].lo - slack <= slope) & (slope <= found[3].hi + slack))
    narrow = half < 1e-12
    assert all(np.max((of.hi - of.lo)[narrow]) < 1e-7 for of in found[:2]) or len(ground.kinks)


@pytest.mark.parametrize("name", ["bump", "step", "pchip"])
def test_arc_length_is_held(name: str, float64):
    track = TRACKS[name]()
    arc = Arc.along(ground_of(track.shape), -1.0, 9.5)
    x = np.linspace(-0.9, 9.4, 57)
    found = arc.at(interval(x))
    odometer = Odometer.along(track, -1.0, 9.5)
    with jax.enable_x64(True):
        exact = np.asarray(odometer.distance(x))
    # The odometer itself is exact to 1e-12 m where knots lie inside its cells, else to rounding.
    assert np.all((found.lo - 1e-10 <= exact) & (exact <= found.hi + 1e-10))
    assert np.max(found.radius) < 1e-4


def test_ground_given_as_a_function_is_refused_with_the_way_out():
    track = Track.from_function(lambda x: 0.01 * x)
    problem = PostureProblem(PostureProblem.along("bump").params, track, np.array([3.0, 3.2, 3.4]))
    with pytest.raises(ValueError, match=r"Function; accepted: .*Track\.resampled"):
        solve(problem, "branch")  # before a drive is looked for
