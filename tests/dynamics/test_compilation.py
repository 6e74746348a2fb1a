"""Programs that run once: the same numbers in fewer passes of the compiler, wherever they stand."""

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.pytrees import run_once


def wave(order, x):
    for _ in range(order):
        x = jnp.sin(x) + 0.5 * x**2
    return x


def test_the_value_is_the_functions_own_in_and_outside_of_transformations(dtype):
    quick, x = run_once(wave, fixed=1), jnp.linspace(0.0, 1.0, 7, dtype=dtype)
    near = {"rtol": 50 * float(jnp.finfo(dtype).eps)}
    expected = wave(3, x)
    assert quick(3, x).dtype == dtype
    np.testing.assert_allclose(quick(3, x), expected, **near)
    np.testing.assert_allclose(jax.jit(lambda x: quick(3, x))(x), expected, **near)
    np.testing.assert_allclose(jax.vmap(lambda x: quick(3, x))(x), expected, **near)
    slope = jax.vmap(jax.grad(lambda x: quick(3, x)))(x)
    np.testing.assert_allclose(slope, jax.vmap(jax.grad(lambda x: wave(3, x)))(x), **near)
