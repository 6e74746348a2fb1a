"""The way along the ground is its arc length, and grows at the rate that the slope says."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from stickslip.dynamics.ugv.track import Odometer, Track

PLACES = np.asarray([0.0, 0.013, 1.1, 3.3, 4.17, 5.5, 7.99, 8.0])
JOINTS = (1.5, 2.5, 3.25, 3.75, 4.25, 4.75, 5.5, 6.5)


def reference(track, places):
    """Arc lengths from 0 by adaptive quadrature, joints of the closed forms told to it."""
    rate = jax.jit(lambda u: jnp.sqrt(1 + track.slope(u) ** 2))

    def along(x):
        inner = [joint for joint in JOINTS if min(x, 0) < joint < max(x, 0)]
        fine = {"epsabs": 1e-13, "epsrel": 1e-13, "limit": 500}
        return quad(lambda u: float(rate(u)), 0.0, x, **fine, points=inner or None)[0]

    return [along(x) for x in places]


@jax.jit
def distances(odometer, x):
    return odometer.distance(x)


@pytest.mark.parametrize("name", ["bump", "sinusoid", "ramp", "step", "ditch", "rough"])
def test_distance_is_the_arc_length(name, float64):
    track = Track.named(name)
    odometer = Odometer.along(track, 0.0, 8.0)
    edges = odometer.edges + odometer.rests
    some = np.flatnonzero((edges >= 0) & (edges <= 8))[::29]
    exact = reference(track, edges[some])
    found = edges[some] + odometer.excess[some]
    np.testing.assert_allclose(found, exact, rtol=1e-13, atol=2e-12, err_msg="what is stored")
    exact = reference(track, PLACES)
    found = distances(odometer, jnp.asarray(PLACES))
    np.testing.assert_allclose(found, exact, rtol=1e-13, atol=2e-12, err_msg="what is asked")


def test_distance_along_a_straight_is_exact_anywhere(dtype):
    odometer = Odometer.along(Track.incline(0.75), 1.0, 3.0, cells=7)
    x = jnp.asarray([-100.0, 0.0, 1.0, 2.2, 3.0, 3.5, 250.0], dtype)
    found = odometer.distance(x.reshape(7, 1))
    assert found.dtype == dtype
    np.testing.assert_allclose(found.ravel(), 1.25 * (x - 1.0), rtol=4 * jnp.finfo(dtype).eps)


def test_beyond_the_ends_the_error_is_as_stated(float64):
    track = Track.sinusoid()
    odometer = Odometer.along(track)
    places = (8.5, -0.5, 9.0, -1.0)
    off = odometer.distance(jnp.asarray(places)) - jnp.asarray(reference(track, places))
    assert np.all(np.abs(off) < np.array([2e-10, 2e-10, 4e-7, 4e-7]))


def test_distance_grows_as_the_slope_says(float64):
    """dS/dx = sqrt(1 + f'^2), at cells' edges and beyond the ends too, and d2S/dx2 follows."""
    track = Track.sinusoid(0.3)
    odometer = Odometer.along(track, cells=8)  # so coarse that the rule's own slope is off
    x = jnp.asarray([-1.0, 0.0, 0.3, 1.0, 4.77, 8.0, 9.5])
    _, slope, second = track.profile(x)
    rate = np.sqrt(1 + slope**2)
    for differentiate in (jax.grad, jax.jacfwd):
        first = differentiate(odometer.distance)
        np.testing.assert_allclose(jax.jit(jax.vmap(first))(x), rate, rtol=1e-14)
        np.testing.assert_allclose(
            jax.jit(jax.vmap(differentiate(first)))(x), slope * second / rate, atol=1e-13
        )


def test_distance_follows_the_tracks_numbers_under_jit_vmap_and_grad(float64):
    @jax.jit
    def length(amplitude, x):
        return Odometer.along(Track.sinusoid(amplitude, 3.0), 0.0, 8.0, cells=64).distance(x)

    amplitudes, x, h = jnp.asarray([0.1, 0.2, 0.4]), jnp.asarray(6.3), 1e-5
    lengths = jax.vmap(length, in_axes=(0, None))(amplitudes, x)
    exact = [reference(Track.sinusoid(a, 3.0), [6.3])[0] for a in (0.1, 0.2, 0.4)]
    np.testing.assert_allclose(lengths, exact, rtol=1e-12)
    difference = [(length(a + h, x) - length(a - h, x)) / (2 * h) for a in amplitudes]
    for differentiate in (jax.grad, jax.jacfwd):
        found = jax.jit(jax.vmap(differentiate(length), in_axes=(0, None)))(amplitudes, x)
        np.testing.assert_allclose(found, difference, rtol=1e-8)
    tracks = jax.vmap(lambda a: Track.sinusoid(a, 3.0).astype(float))(amplitudes)
    odometers = jax.jit(jax.vmap(Odometer.along))(tracks)
    np.testing.assert_allclose(jax.vmap(lambda o: o.distance(x))(odometers), lengths, rtol=1e-12)


def test_single_precision_keeps_its_digits():
    """After 20 m: the sum of 256 cells costs no more than rounding the distance itself does."""
    x = np.linspace(-1.0, 21.0, 500).astype(np.float32)
    single = distances(Odometer.along(Track.rough(2)), jnp.asarray(x))
    with jax.enable_x64(True):
        double = distances(Odometer.along(Track.rough(2)), jnp.asarray(x, float))
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, double, atol=2 * np.spacing(np.float32(20.0)))


def test_a_function_is_measured_too(dtype):
    track = Track.from_function(lambda x: 2 * jnp.cosh(x / 2), 0.0, 4.0)  # a catenary
    x = jnp.asarray([0.5, 2.0, 4.0], dtype)
    found = jax.jit(Odometer.along(track).distance)(x)
    np.testing.assert_allclose(found, 2 * np.sinh(np.asarray(x) / 2), rtol=1e-6)


def test_replacing_the_ground_or_an_end_integrates_anew(float64):
    odometer = Odometer.along(Track.bump())
    for changes in ({"track": Track.sinusoid(0.1)}, {"start": -1.0}, {"end": 9.0}):
        changed = replace(odometer, **changes)
        wanted = Odometer.along(changed.track, changed.start, changed.end)
        assert float(changed.distance(7.5)) == float(wanted.distance(7.5))
    with pytest.raises((ValueError, TypeError), match="excess"):  # the latter from Python 3.13 on
        replace(odometer, excess=odometer.excess)
