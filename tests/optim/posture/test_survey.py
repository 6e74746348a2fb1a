"""Treatments of a survey's points change what they name, by what they say."""

import re

import numpy as np
import pytest

from stickslip.optim.posture.track_file import enveloped, read_survey, read_track
from tests.optim.posture.test_track_file import gpx, write


def profile(x):
    return 0.5 * np.sin(2 * np.pi * x / 40) + 0.15 * np.sin(2 * np.pi * x / 11 + 1)


def surveyed(folder, x, y, **treatments):
    lines = "\n".join(f"{a!r},{b!r}" for a, b in zip(x.tolist(), y.tolist(), strict=True))
    return read_survey(write(folder, lines), **treatments)


X = np.arange(0.0, 100.0, 2.0)


def test_repeated_and_backward_points_are_sorted_and_merged_at_their_mean(tmp_path):
    x, y = np.array([0.0, 2.0, 2.0, 1.0, 3.0, 3.04]), np.array([0.0, 1.0, 3.0, 5.0, 6.0, 8.0])
    same = surveyed(tmp_path, x, y, merge=0.0)
    np.testing.assert_array_equal(same.used, [[0, 0], [1, 5], [2, 2], [3, 6], [3.04, 8]])
    assert (same.changes["reordered"], same.changes["merged"], same.changes["knots"]) == (3, 1, 5)
    np.testing.assert_array_equal(same.raw, np.stack([x, y], 1))
    near = surveyed(tmp_path, x, y, merge=0.05)
    np.testing.assert_allclose(near.used[-1], [3.02, 7.0])
    assert near.changes["merged"] == 2


def test_fixes_of_a_standing_receiver_become_one_and_add_no_distance(tmp_path):
    """Three fixes about one place; the legs on both sides are 11.1 m."""
    degree = 1e-4
    fixes = [(59, 10, 1), (59 + degree, 10, 2), (59 + degree, 10 + 1e-5, 4), (59 + degree, 10, 3)]
    path = write(tmp_path, gpx(*fixes, (59 + 2 * degree, 10, 5)), "walk.gpx")
    found = read_survey(path, merge=1.0)
    np.testing.assert_allclose(found.used[:, 1], [1, 3, 5])
    np.testing.assert_allclose(np.diff(found.used[:, 0]), 11.12, atol=0.01)
    assert found.changes["merged"] == 2


def test_outliers_are_dropped_and_slopes_are_not(tmp_path):
    y = X.copy()
    y[20] += 3.0
    found = surveyed(tmp_path, X, y, outliers=2.5)
    np.testing.assert_array_equal(found.used, np.stack([X, X], 1)[np.arange(50) != 20])
    assert found.changes["dropped"] == 1


def test_a_gap_is_filled_by_a_straight_line(tmp_path):
    kept = (X < 30) | (X >= 50)
    found = surveyed(tmp_path, X[kept], profile(X[kept]), gaps=5.0)
    assert (found.changes["filled"], found.changes["longest_gap"]) == (1, 22.0)
    np.testing.assert_allclose(found.used[:, 0], X, rtol=1e-12)
    within = np.interp(X[15:25], X[kept], profile(X[kept]))
    np.testing.assert_allclose(found.used[15:25, 1], within, rtol=1e-12)


@pytest.mark.parametrize(
    ("noise", "spacing", "merge"), [(0.4, 2.0, None), (0.5, 2.0, None), (0.02, 0.003, 0.05)]
)
def test_noise_of_a_stated_level_is_removed(noise, spacing, merge, tmp_path):
    """The residual is the stated level, and the true ground is nearer than that. A lidar line is
    out of order within its noise, and merging divides the noise by the root of the count."""
    rng = np.random.default_rng(3)
    x = np.arange(0.0, 60.0 if merge else 200.0, spacing)
    x = x[np.argsort(x + 5 * spacing * rng.standard_normal(len(x)))] if merge else x
    stated = noise * np.sqrt(spacing / merge) if merge else noise
    y = profile(x) + noise * rng.standard_normal(len(x))
    found = surveyed(tmp_path, x, y, noise=stated, **({"merge": merge} if merge else {}))
    assert found.changes["rms_change"] == pytest.approx(stated, rel=0.01)
    at, height = found.used.T
    assert np.sqrt(np.mean((height - profile(at)) ** 2)) < stated
    assert found.changes["largest_change"] >= found.changes["rms_change"]
    if not merge:  # the line across a hole is not of the points that were read
        read = (x < 50) | (x > 110)
        found = surveyed(tmp_path, x[read], y[read], noise=noise, gaps=5.0)
        assert found.changes["rms_change"] == pytest.approx(noise, rel=0.01)


def test_the_named_wavelength_is_halved(tmp_path):
    x = np.arange(0.0, 200.0, 0.25)
    for length, share in ((8.0, 0.5), (16.0, 16 / 17), (4.0, 1 / 17)):
        found = surveyed(tmp_path, x, np.sin(2 * np.pi * x / length), smooth=8.0)
        middle = slice(200, 600)
        amplitude = np.max(np.abs(found.used[middle, 1]))
        assert amplitude == pytest.approx(share, rel=0.02)


def centres(x, y, at, radius):
    """Height of a disc's centre on dense points, by brute force."""
    square = radius**2 - (at[:, None] - x) ** 2
    return np.max(np.where(square >= 0, y + np.sqrt(np.maximum(square, 0)), -np.inf), axis=1)


@pytest.mark.parametrize("kind", ["noise", "ditch", "lidar"])
def test_the_envelope_is_what_a_disc_feels(kind):
    """The disc's centre runs over the envelope as over the points; it is nowhere hollower."""
    radius, rng = 0.3, np.random.default_rng(3)
    if kind == "ditch":
        x, y = np.array([0.0, 2.0, 2.3, 2.6, 4.0, 6.0]), np.array([0.0, 0.0, -0.2, 0.0, 0.5, 0.2])
    elif kind == "noise":
        x, y = np.arange(0.0, 12.0, 0.4), 0.1 * rng.standard_normal(30)
    else:
        x = np.sort(rng.uniform(0, 6, 2000))
        y = 0.1 * np.sin(x) + 0.02 * rng.standard_normal(2000)
    knots, ground = enveloped(x, y, radius)
    at = np.linspace(x[0] + 2 * radius, x[-1] - 2 * radius, 300)
    dense = np.linspace(x[0], x[-1], 60_001)
    dense = np.unique(np.concatenate([dense, x]))
    from_points = centres(dense, np.interp(dense, x, y), at, radius)
    over = centres(dense, np.interp(dense, knots, ground), at, radius)
    corner = np.max(np.abs(np.diff(np.diff(y) / np.diff(x)))) if kind != "lidar" else 0.64
    np.testing.assert_allclose(over, from_points, rtol=0, atol=corner * radius / 64)
    assert np.all(ground > np.interp(knots, x, y) - 0.01 * radius) or kind == "lidar"
    slope = np.gradient(ground, knots)
    bend = np.diff(ground, 2) / np.diff(knots)[:-1] ** 2 / (1 + slope[1:-1] ** 2) ** 1.5
    assert np.max(bend) < 1.05 / radius


@pytest.mark.parametrize(
    ("treatments", "text"),
    [
        ({"nois": 1.0}, "nois"),
        ({"noise": 0.0}, "noise = 0.0 is not accepted; accepted: a length > 0 [m]"),
        ({"merge": -1.0}, "merge = -1.0 is not accepted; accepted: a length >= 0 [m]"),
        ({"noise": 1.0, "smooth": 1.0}, "noise = 1.0 and smooth = 1.0; accepted: one of them"),
        ({"smooth": 1.0}, "track.csv: 3 points; accepted: 5 or more for noise and smooth"),
        ({"merge": 9.0}, "track.csv: 1 points are left; accepted: 2 or more"),
        ({"envelope": 1e-9}, "track.csv: envelope = 1e-09"),
        ({"gaps": 1e-9}, "track.csv: gaps = 1e-09"),
    ],
)
def test_treatments_that_cannot_be_are_refused(treatments, text, tmp_path):
    with pytest.raises(ValueError, match=re.escape(text)):
        surveyed(tmp_path, np.arange(3.0), np.zeros(3), **treatments)


def test_a_refusal_names_the_treatment(tmp_path):
    with pytest.raises(ValueError, match="--ground merge"):
        surveyed(tmp_path, np.array([0.0, 2.0, 1.0]), np.zeros(3))
    fixes = [(59, 10, 1), (59, 10, 1), (60, 10, 1)]
    with pytest.raises(ValueError, match=r"again .*--ground merge"):
        read_track(write(tmp_path, gpx(*fixes), "walk.gpx"))
    with pytest.raises(ValueError, match="--ground outliers=1 drops"):
        read_track(write(tmp_path, gpx((59, 10, 1), (59.001, 10, 900)), "walk.gpx"))
