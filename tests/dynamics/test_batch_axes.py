"""Rules for derivatives under vmap inside jit: the batch stands where the value has it."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.interpreters import batching

from stickslip.dynamics import batch_axes, jax_versions
from stickslip.dynamics.batch_axes import in_front_p
from stickslip.dynamics.fused import fused
from stickslip.dynamics.lanes import where_needed

TURN = np.array([[1.0, 2.0], [3.0, 5.0]], np.float32)
POINTS = np.array([[0.5, 0.7], [1.1, 1.3]], np.float32)
"""As many as each has coordinates: an axis in the wrong place is not refused."""


@fused
def turned(x):
    """A product, behind which vmap leaves the batch last, and a number that no member changes."""
    return {"place": jnp.dot(TURN, x) ** 2, "same": jnp.float32(3.0) * jnp.ones(2)}


def chosen(x):
    """What is needed where the first coordinate is above 1 has the batch last, too."""
    found = where_needed(x[0] > 1, lambda x: jnp.dot(TURN, x) ** 2, (x,), x)
    return {"place": found, "same": jnp.float32(3.0) * jnp.ones(2)}


def worth(function, points):
    """Weighed differently for each member and coordinate."""
    found = jax.vmap(function)(points)
    weights = jnp.asarray([[1.0, 10.0], [100.0, 1000.0]])
    return jnp.sum(weights * found["place"] * found["same"])


@pytest.mark.parametrize("function", [turned, chosen])
@pytest.mark.parametrize("wrapped", [jax.jit, jax.checkpoint])
def test_the_gradient_of_a_jitted_batch_is_that_of_its_members(function, wrapped):
    slope = jax.grad(wrapped(partial(worth, function)))(POINTS)
    weights = np.array([[1.0, 10.0], [100.0, 1000.0]])
    image = POINTS @ TURN.T
    expected = (3 * weights * 2 * image) @ TURN
    if function is chosen:
        expected[0] = 3 * weights[0]
    np.testing.assert_allclose(slope, expected, rtol=1e-6)


def test_second_derivatives_and_batches_of_batches():
    many = np.stack([POINTS, 2 * POINTS, POINTS - 1])
    inner = jax.jit(jax.grad(jax.jit(partial(worth, turned))))
    both = jax.jit(jax.vmap(jax.jacfwd(inner)))(many)
    one = jax.hessian(lambda x: jnp.sum(jnp.array([1.0, 10.0]) * 3 * (TURN @ x) ** 2))(POINTS[0])
    assert both.shape == (3, 2, 2, 2, 2)
    np.testing.assert_allclose(both[:, 0, :, 0, :], np.stack([one] * 3), rtol=1e-6)
    np.testing.assert_array_equal(both[:, 0, :, 1, :], 0)


def test_a_newer_jax_that_takes_the_rules_has_them(untried):
    assert batch_axes._refused() is None


def _moves_nothing(operands, axes):
    return operands[0], axes[0] or 0


@pytest.fixture(params=["no rules", "another rule"])
def ruleless(request, untried, monkeypatch):
    """As if JAX had taken no rules, or made something else of them."""
    if request.param == "no rules":
        monkeypatch.setitem(jax_versions._unregistered, in_front_p, KeyError("no place for them"))
        yield
    else:
        batching.primitive_batchers[in_front_p] = _moves_nothing
        yield
        batching.primitive_batchers[in_front_p] = batch_axes._batched


def test_without_its_rules_derivatives_of_a_batch_are_refused(ruleless):
    slope = jax.grad(jax.jit(lambda x: jnp.sum(turned(x)["place"])))(POINTS[0])
    np.testing.assert_allclose(slope, 2 * TURN @ POINTS[0] @ TURN, rtol=1e-6)
    with pytest.raises(NotImplementedError, match="derivatives of a batch"):
        jax.grad(jax.jit(partial(worth, turned)))(POINTS)
