"""Random ground: ISO 8608's classes, its spectrum, its seeds."""

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.ugv.ground.roughness import CLASSES, class_roughness, rough_waves
from stickslip.dynamics.ugv.track import Track


def test_rough_ground_has_the_variance_and_spectrum_of_its_class(float64):
    """Mean squares over 4000 grounds, of height and derivatives, against the band's integrals."""
    level, (low, high) = class_roughness("D"), (0.05, 1.0)
    keys = jax.random.split(jax.random.key(3), 4000)
    draw = jax.jit(jax.vmap(lambda key: rough_waves(key, level).profile(jnp.asarray(1.7))))
    sigma, w = np.sqrt(2 / 4000), 2 * np.pi  # sigma: of the mean square of a nearly normal variable
    integrals = (1 / low - 1 / high, w**2 * (high - low), w**4 * (high**3 - low**3) / 3)
    for drawn, integral in zip(map(np.asarray, draw(keys)), integrals, strict=True):
        integral *= level * 0.01
        assert abs(np.mean(drawn)) < 4 * np.sqrt(integral / 4000)
        assert abs(np.mean(drawn**2) / integral - 1) < 4 * sigma + 1e-3


def test_amplitudes_hold_the_variance_of_any_part_of_the_band(float64):
    """At 1 / 20 and at 1 cycle/m, not only in sum: G falls with the square of the frequency."""
    waves = rough_waves(jax.random.key(0), 1.0, waves=950)
    power, n = np.asarray(waves.amplitudes) ** 2 / 2, np.asarray(waves.frequencies)
    np.testing.assert_allclose(power / 0.001, (n / 0.1) ** -2, rtol=1e-12)
    np.testing.assert_allclose(power[n < 0.1].sum(), 0.01 * (20 - 10), rtol=1e-9)


def test_a_seed_is_a_key_and_one_ground_in_both_precisions():
    x = np.linspace(0.0, 20.0, 64)
    grounds = []
    for wide in (False, True):
        with jax.enable_x64(wide):
            at = jnp.asarray(x, float)
            grounds.append(np.asarray(Track.rough(11).height(at)))
            np.testing.assert_array_equal(Track.rough(jax.random.key(11)).height(at), grounds[-1])
            assert np.max(np.abs(Track.rough(12).height(at) - grounds[-1])) > 1e-3
            for k, name in enumerate(CLASSES):  # a factor of four apart in power
                height = np.asarray(Track.rough(11, name).height(at))
                np.testing.assert_allclose(height, 2.0 ** (k - 2) * grounds[-1], atol=1e-5)
    np.testing.assert_allclose(*grounds, atol=1e-6)


def test_rough_ground_is_drawn_inside_jit(dtype):
    """The key traced; the table is as good as the waves to the stated errors."""
    x = jnp.linspace(0.0, 20.0, 1000, dtype=dtype)

    @jax.jit
    def draw(key):
        return Track.rough(key).profile(x), rough_waves(key, class_roughness("C")).profile(x)

    table, waves = draw(jax.random.key(4))
    for one, other, error in zip(table, waves, (5e-8, 1e-6, 4e-5), strict=True):
        assert one.dtype == dtype
        np.testing.assert_allclose(one, other, atol=error)
