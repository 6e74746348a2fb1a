"""One walk, many walks, either precision, compiled or not: the same numbers."""

from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedState, simulate, step
from tests.dynamics.biped.helpers import default_model, default_params, state_of
from tests.trees import assert_same

MEMBERS = 8


@lru_cache
def batch(dtype: str = "float64"):
    """States, torques and friction of walks that stick, slip, stop and exchange."""
    rng = np.random.default_rng(11)
    value = lambda low, high: jnp.asarray(rng.uniform(low, high, MEMBERS), dtype)  # noqa: E731
    states = BipedState(
        phase=value(1.6, 4.7),
        steps=jnp.asarray(rng.integers(-3, 4, MEMBERS), jnp.int32),
        crank_rate=value(-4, 6),
        foot_position=value(-0.1, 0.1),
        foot_velocity=value(-0.2, 0.2) * jnp.asarray(np.arange(MEMBERS) % 2, dtype),
        time=value(0, 1),
    )
    kinetic = value(0.02, 0.1)
    return states, value(-1, 2), Scene.uniform(kinetic + jnp.asarray(0.02, dtype), kinetic)


@jax.jit
def many(model, scenes, states, torques, size):
    return jax.vmap(step, in_axes=(None, 0, 0, 0, None))(model, scenes, states, torques, size)


def member(tree, index):
    return jax.tree.map(lambda leaf: leaf[index], tree)


@pytest.mark.long
def test_a_batch_is_a_loop_of_single_walks(dtype):
    model, size = default_model(dtype=dtype.name), jnp.asarray(0.02, dtype)
    states, torques, scenes = batch(dtype.name)
    together = many(model, scenes, states, torques, size)
    for index in range(MEMBERS):
        alone = step(model, *(member(x, index) for x in (scenes, states, torques)), size)
        tolerance = 2e-5 if dtype == jnp.float32 else 1e-12
        assert_same(member(together, index), alone, rtol=tolerance, atol=tolerance)


def test_a_robot_of_plain_numbers_walks_inside_a_callers_own_program(float64):
    robot = default_params()

    def walked(torque):
        start = BipedState(phase=jnp.asarray(2.0), crank_rate=jnp.asarray(3.0))
        return simulate(robot, Scene.grip(), start, torque, 0.02, 0.01).final

    traced = jax.eval_shape(jax.vmap(walked), jnp.zeros(3))
    assert traced.phase.shape == (3,)


def test_types_stay_what_they_are(dtype):
    model, size = default_model(dtype=dtype.name), jnp.asarray(0.02, dtype)
    states, torques, scenes = batch(dtype.name)
    after, contact = jax.eval_shape(many, model, scenes, states, torques, size)
    for leaf in jax.tree.leaves((after, contact)):
        assert leaf.dtype in (dtype, jnp.int32)
    for name in ("phase", "crank_rate", "foot_position", "foot_velocity", "time"):
        assert getattr(after, name).dtype == dtype, name
    for leaf in (after.steps, contact.mode, contact.status, contact.switches):
        assert leaf.dtype == jnp.int32


def test_a_float32_robot_stays_so_where_float64_is_switched_on(float64):
    """Plain numbers, which JAX takes for float64 there, follow the robot."""
    model, scene = default_model(dtype="float32"), Scene.uniform(0.1, 0.05)
    found = jax.eval_shape(lambda: step(model, scene, BipedState(), 1.0, 0.01))
    for leaf in jax.tree.leaves(found):
        assert leaf.dtype in (jnp.float32, jnp.int32)


def walk_in(dtype: str):
    model, torque = default_model(dtype=dtype), jnp.full(200, 1.2, dtype)
    scene = Scene.uniform(jnp.asarray(0.15, dtype), jnp.asarray(0.12, dtype))
    return simulate(model, scene, state_of(dtype), torque, 1.0, 0.005)


def test_single_precision_walks_like_double(float64):
    """Through two slips and a stop; rounding grows to 1e-4 at the most."""
    single, double = walk_in("float32"), walk_in("float64")
    assert single.states.phase.dtype == jnp.float32
    for name in ("phase", "crank_rate", "foot_position", "foot_velocity"):
        a, b = (np.asarray(getattr(t.states, name), float) for t in (single, double))
        assert np.max(np.abs(a - b)) < 2e-4 * max(1.0, np.max(np.abs(b))), name
    np.testing.assert_array_equal(single.contacts.switches, double.contacts.switches)
