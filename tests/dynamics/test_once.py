"""Programs that run once: the same numbers in fewer passes of the compiler, wherever they stand."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import once
from stickslip.dynamics.once import run_once


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


def test_numbers_at_hand_do_inside_of_a_trace():
    quick, x = run_once(wave, fixed=1), np.float32(0.3)
    assert jax.jit(lambda y: y + quick(2, x))(1.0) == pytest.approx(1 + float(wave(2, x)), rel=1e-6)
    assert jax.grad(lambda y: y * quick(2, x))(1.0) == pytest.approx(float(wave(2, x)), rel=1e-6)
    with jax.ensure_compile_time_eval():
        assert float(quick(2, x)) == pytest.approx(float(wave(2, x)), rel=1e-6)


def test_options_that_the_compiler_does_not_know_are_left_out(monkeypatch):
    level = {"xla_backend_optimization_level": 0}
    monkeypatch.setattr(once, "_unknown", set())
    monkeypatch.setattr(once, "IN_A_HURRY", {"xla_cpu_no_such_thing": True} | level)
    assert float(run_once(wave, fixed=1)(2, 0.3)) == pytest.approx(float(wave(2, 0.3)), rel=1e-6)
    assert once.known(once.IN_A_HURRY) == level
    monkeypatch.setattr(once, "IN_A_HURRY", {"xla_cpu_nor_this": 1})
    assert float(run_once(wave, fixed=1)(2, 0.3)) == pytest.approx(float(wave(2, 0.3)), rel=1e-6)
    assert once.known(once.IN_A_HURRY) == {}


def test_what_fails_while_it_runs_is_not_tried_again():
    calls = []

    def fails(x):
        calls.append(x)
        raise jax.errors.JaxRuntimeError("out of everything")

    with pytest.raises(jax.errors.JaxRuntimeError, match="out of everything"):
        run_once(fails)(1.0)
    assert len(calls) == 1
