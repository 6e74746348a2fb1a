"""Motion of the links by the crank angle: exact, and by the chapter's differences."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.biped.mechanism.link_motion import link_motion
from tests.dynamics.biped.helpers import default_params


@jax.jit
def motion_along(params, angles):
    return jax.vmap(lambda angle: link_motion(params, angle))(angles)


@partial(jax.jit, static_argnums=2)
def differenced_along(params, angles, step):
    return jax.vmap(lambda angle: link_motion(params, angle, step))(angles)


def test_exact_motion_is_that_of_central_differences(float64):
    params, h = default_params(), 1e-4
    angles = np.linspace(0, 2 * np.pi, 90)
    now, before, after = (motion_along(params, jnp.asarray(angles + d)) for d in (0, -h, h))
    first = (after.centres - before.centres) / (2 * h)
    second = (after.centres - 2 * now.centres + before.centres) / h**2
    np.testing.assert_allclose(now.centre_slopes, first, atol=1e-8)
    np.testing.assert_allclose(now.centre_curvatures, second, atol=1e-6)
    turns = np.unwrap(np.stack([before.angles, now.angles, after.angles]), axis=0)
    np.testing.assert_allclose(now.angle_slopes, (turns[2] - turns[0]) / (2 * h), atol=1e-7)
    bend = (turns[2] - 2 * turns[1] + turns[0]) / h**2
    np.testing.assert_allclose(now.angle_curvatures, bend, atol=1e-5)


def test_the_chapters_differences_are_of_first_order_also_where_an_angle_jumps_by_a_turn(float64):
    params, angles = default_params(), jnp.linspace(0, 2 * np.pi, 90)
    exact = motion_along(params, angles)
    assert np.any(np.abs(np.diff(exact.angles, axis=0)) > 6)  # an angle does jump
    names = ("centre_slopes", "centre_curvatures", "angle_slopes", "angle_curvatures")
    off = {
        step: [
            float(jnp.max(jnp.abs(getattr(motion, name) - getattr(exact, name)))) for name in names
        ]
        for step in (2e-3, 1e-3)
        for motion in [differenced_along(params, angles, step)]
    }
    assert np.array(off[2e-3]) / np.array(off[1e-3]) == pytest.approx(2.0, abs=0.02)
    assert max(off[1e-3]) < 0.02


def test_differenced_motion_keeps_the_exact_places(dtype):
    params, angles = default_params(dtype.name), jnp.linspace(0, 2 * np.pi, 90, dtype=dtype)
    exact, rough = motion_along(params, angles), differenced_along(params, angles, 1e-3)
    assert all(leaf.dtype == dtype for leaf in jax.tree.leaves(rough))
    tolerance = 100 * float(jnp.finfo(dtype).eps)
    np.testing.assert_allclose(rough.centres, exact.centres, atol=tolerance)
    np.testing.assert_allclose(rough.hip_pins, exact.hip_pins, atol=tolerance)
    np.testing.assert_allclose(rough.pins.K, exact.pins.K, atol=tolerance)
