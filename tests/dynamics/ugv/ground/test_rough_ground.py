"""Random ground: ISO 8608's classes, its spectrum, its seeds."""

from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.ugv.ground.roughness import (
    CLASSES,
    band_variance,
    class_roughness,
    rough_shape,
    rough_waves,
)
from stickslip.dynamics.ugv.track import Track

# Rough ground


def test_rough_ground_has_the_variance_and_spectrum_of_its_class(float64):
    """Mean squares over 4000 grounds, of height and derivatives, against the band's integrals."""
    level, band = class_roughness("D"), (0.05, 1.0)
    keys = jax.random.split(jax.random.key(3), 4000)
    draw = jax.jit(jax.vmap(lambda key: rough_waves(key, level).profile(jnp.asarray(1.7))))
    height, slope, second = (np.asarray(part) for part in draw(keys))
    sigma = np.sqrt(2 / 4000)  # of the mean square of a nearly normal variable
    in_slope = level * 0.01 * (2 * np.pi) ** 2 * (band[1] - band[0])
    in_second = level * 0.01 * (2 * np.pi) ** 4 * (band[1] ** 3 - band[0] ** 3) / 3
    for drawn, integral in (
        (height, band_variance(level, band)), (slope, in_slope), (second, in_second)
    ):  # fmt: skip
        assert abs(np.mean(drawn)) < 4 * np.sqrt(integral / 4000)
        assert abs(np.mean(drawn**2) / integral - 1) < 4 * sigma + 1e-3


def test_amplitudes_hold_the_variance_of_any_part_of_the_band(float64):
    """At 1 / 20 and at 1 cycle/m, not only in sum: G falls with the square of the frequency."""
    waves = rough_waves(jax.random.key(0), 1.0, waves=950)
    power, n = np.asarray(waves.amplitudes) ** 2 / 2, np.asarray(waves.frequencies)
    np.testing.assert_allclose(power / 0.001, (n / 0.1) ** -2, rtol=1e-12)
    np.testing.assert_allclose(power.sum(), band_variance(1.0), rtol=1e-12)
    np.testing.assert_allclose(power[n < 0.1].sum(), 0.01 * (20 - 10), rtol=1e-9)


def test_classes_are_a_factor_of_four_apart(float64):
    assert class_roughness("A") == 16e-6
    x = jnp.linspace(0.0, 20.0, 50)
    grounds = [np.asarray(Track.rough(7, name).height(x)) for name in CLASSES]
    for smooth, rough in pairwise(grounds):
        np.testing.assert_allclose(rough, 2 * smooth, rtol=1e-9, atol=1e-15)


def test_a_seed_is_a_key_and_one_ground_in_both_precisions():
    x = np.linspace(0.0, 20.0, 64)
    grounds = []
    for wide in (False, True):
        with jax.enable_x64(wide):
            at = jnp.asarray(x, float)
            grounds.append(np.asarray(Track.rough(11).height(at)))
            np.testing.assert_array_equal(Track.rough(jax.random.key(11)).height(at), grounds[-1])
            assert np.max(np.abs(Track.rough(12).height(at) - grounds[-1])) > 1e-3
    np.testing.assert_allclose(*grounds, atol=1e-6)


def test_rough_ground_is_drawn_inside_jit(dtype):
    """Key, roughness and ends traced; the table is as good as the waves to the stated errors."""
    x = jnp.linspace(0.0, 20.0, 1000, dtype=dtype)

    @jax.jit
    def draw(key, roughness, start, end):
        shape = rough_shape(key, roughness, start, end, pieces=192)
        return shape.profile(x), rough_waves(key, roughness).profile(x)

    numbers = (jnp.asarray(v, dtype) for v in (class_roughness("C"), -2.0, 22.0))
    table, waves = draw(jax.random.key(4), *numbers)
    for one, other, error in zip(table, waves, (5e-8, 4e-7, 2e-5), strict=True):
        assert one.dtype == dtype
        np.testing.assert_allclose(one, other, atol=error)
