"""Programs that run once: the same numbers in fewer passes of the compiler, wherever they stand."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import BipedParams, Table, prepare
from stickslip.dynamics.compilation import IN_A_HURRY, run_once


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


def options_asked(monkeypatch, call):
    """Options with which programs are compiled during a call."""
    from jax._src import compiler

    asked, plain = [], compiler.get_compile_options

    def listening(*args, env_options_overrides=None, **kwargs):
        asked.append(env_options_overrides or {})
        return plain(*args, env_options_overrides=env_options_overrides, **kwargs)

    monkeypatch.setattr(compiler, "get_compile_options", listening)
    call()
    return [dict(options) for options in asked]


def test_a_robot_is_prepared_in_a_hurry_outside_of_a_trace_alone(monkeypatch):
    robot = BipedParams.from_bars()
    prepared = partial(prepare, fidelity=Table(5, 3))  # that nothing else compiles
    asked = options_asked(monkeypatch, lambda: prepared(robot))
    assert IN_A_HURRY in asked
    traced = jax.jit(prepared)
    assert IN_A_HURRY not in options_asked(monkeypatch, lambda: traced(robot))
    both = jax.tree.leaves(prepared(robot)), jax.tree.leaves(traced(robot))
    for one, other in zip(*both, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-4, atol=1e-6)
