"""Members of a batch that need more than others or nothing; derivatives of batched functions."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.kernels import fused as kernels
from stickslip.dynamics.kernels.fused import compacting_while, fused, where_needed


def halve(limit, start):
    """Halved until below the limit; how often."""

    def going(limit, state):
        return state[0] > limit

    def body(limit, state):
        return state[0] / 2, state[1] + 1

    return compacting_while(going, body, limit, (start, jnp.int32(0)))


@pytest.mark.parametrize("size", [1, kernels.SMALLEST, kernels.LARGEST + 1])
@pytest.mark.parametrize("many", [0, 3, 10**6])
def test_every_member_goes_as_far_as_alone(size, many):
    """Most need one round; so many need up to twenty."""
    rng = np.random.default_rng(size)
    start = np.full(size, 1.5)
    start[: min(size, many)] = 2.0 ** rng.integers(0, 20, min(size, many))
    start = jnp.asarray(rng.permutation(start), jnp.float32)
    limits = jnp.asarray(rng.uniform(1.0, 1.2, size), jnp.float32)
    for limit, axis in ((jnp.float32(1.0), None), (limits, 0)):
        value, rounds = jax.jit(jax.vmap(halve, (axis, 0)))(limit, start)
        wanted = np.maximum(np.ceil(np.log2(np.asarray(start) / np.asarray(limit))), 0)
        np.testing.assert_array_equal(rounds, wanted)
        np.testing.assert_array_equal(value, np.asarray(start) / 2**wanted)


def root(x):
    return {"root": jnp.sqrt(x), "twice": 2 * x}


@pytest.mark.parametrize("needed", [[False] * 5, [True] * 5, [True, False, False, True, False]])
def test_only_those_in_need_are_given_what_is_computed(needed):
    x = jnp.arange(5.0)
    otherwise = {"root": -jnp.ones(5), "twice": jnp.zeros(5)}
    given = jnp.asarray(needed), x, otherwise
    found = jax.vmap(lambda n, x, o: where_needed(n, root, (x,), o))(*given)
    np.testing.assert_allclose(found["root"], np.where(needed, np.sqrt(np.arange(5.0)), -1))
    np.testing.assert_allclose(found["twice"], np.where(needed, 2 * np.arange(5.0), 0))


def test_nothing_is_computed_where_nobody_needs_it():
    """Seen by what it would print."""
    seen = []

    def noted(x):
        jax.debug.callback(lambda value: seen.append(float(np.max(value))), x)
        return x + 1

    def run(needed, x):
        return where_needed(needed, noted, (x,), x)

    batch = jax.jit(jax.vmap(run))
    jax.block_until_ready(batch(jnp.zeros(3, bool), jnp.arange(3.0)))
    jax.effects_barrier()
    assert not seen
    jax.block_until_ready(batch(jnp.array([False, True, False]), jnp.arange(3.0)))
    jax.effects_barrier()
    assert seen


@pytest.mark.parametrize("needed", [True, False])
def test_derivatives_go_through_the_choice(needed):
    def value(x):
        return where_needed(jnp.asarray(needed), lambda x: x**3, (x,), 5 * x)

    slope = jax.grad(value)(jnp.float32(2.0))
    assert slope == (12.0 if needed else 5.0)
    many = jax.vmap(jax.grad(value))(jnp.arange(3.0))
    np.testing.assert_allclose(many, 3 * np.arange(3.0) ** 2 if needed else np.full(3, 5.0))


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
