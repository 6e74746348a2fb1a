"""Many steps in one kernel: what jax.lax.scan makes of them, whatever their number."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.kernels.jax_interface import KERNEL
from stickslip.dynamics.kernels.scan import MOST_STEPS, fused_scan


def decay(power, shared, carry, _):
    """A step that reads all it can, with a row of two kinds."""
    x, key = carry
    key, draw = jax.random.split(key)
    x = shared["pull"] * x**power + 0.1 * jax.random.uniform(draw)
    return (x, key), {"x": x, "high": x > 0.5}


def layered(power, shared, carry, _):
    """One with a product of matrices, which no kernel holds."""
    x, key = carry
    hidden = jnp.tanh(jnp.full((4, 4), shared["pull"]) @ jnp.full(4, x))
    return decay(power, shared, (hidden.sum(), key), None)


def given(size=()):
    carry = jnp.full(size, 0.4), jax.random.split(jax.random.key(0), size)
    return {"pull": jnp.float32(0.7)}, carry


def scanned(step, length, shared, carry, power=2):
    return jax.lax.scan(partial(step, power, shared), carry, length=length)


def assert_equal(found, wanted):
    assert jax.tree.structure(found) == jax.tree.structure(wanted)
    for one, other in zip(jax.tree.leaves(found), jax.tree.leaves(wanted), strict=True):
        assert (one.shape, one.dtype) == (other.shape, other.dtype)
        if jnp.issubdtype(one.dtype, jax.dtypes.prng_key):
            one, other = jax.random.key_data(one), jax.random.key_data(other)
        np.testing.assert_allclose(one, other, rtol=1e-5)


@pytest.mark.parametrize("length", [0, 1, MOST_STEPS, MOST_STEPS + 5])
def test_any_number_of_steps_is_the_scan(length):
    shared, carry = given()
    run = jax.jit(partial(fused_scan, decay, (2,), length=length))
    assert_equal(run(shared, carry), jax.jit(partial(scanned, decay, length))(shared, carry))


@pytest.mark.parametrize("step", [decay, layered])
def test_batches_too(step):
    (shared, carry), length = given((3,)), 37
    run = partial(fused_scan, step, (2,), length=length)
    found = jax.jit(jax.vmap(lambda carry: run(shared, carry)))(carry)
    wanted = jax.jit(jax.vmap(lambda carry: scanned(step, length, shared, carry)))(carry)
    assert_equal(found, wanted)


def test_derivatives_both_ways():
    (shared, (x, key)), length = given(), 37

    def end(scan, x):
        return scan(shared, (x, key))[0][0]

    ours = partial(end, partial(fused_scan, decay, (1,), length=length))
    theirs = partial(end, partial(scanned, decay, length, power=1))
    for derivative in (jax.grad, jax.jacfwd):
        found, wanted = jax.jit(derivative(ours))(x), jax.jit(derivative(theirs))(x)
        assert wanted != 0
        np.testing.assert_allclose(found, wanted, rtol=1e-4)


def test_the_loop_is_in_the_kernel():
    """Of 37 steps, two kernels of 19."""
    shared, carry = given()
    traced = jax.make_jaxpr(partial(fused_scan, decay, (2,), length=37))(shared, carry)
    (loop,) = [one for one in traced.eqns if one.primitive.name == "scan"]
    assert loop.params["length"] == 2
    inside = str(loop.params["jaxpr"])
    assert KERNEL in inside
    assert "scan[" not in inside
