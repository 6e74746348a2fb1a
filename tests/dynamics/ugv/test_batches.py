"""Batches of poses go through one kernel, and each pose is what it is alone."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.kernels.grouping import AS_ONE_KERNEL
from stickslip.dynamics.ugv import Track, UGVParams, balance, equilibrium, place
from stickslip.dynamics.ugv.poses import poses_at
from stickslip.dynamics.ugv.statics import _held
from stickslip.dynamics.ugv.wheel import NEWTON
from tests.dynamics.ugv.helpers import drawn
from tests.trees import assert_same

MARK = next(iter(AS_ONE_KERNEL))
COUNT = 129
"""More than a block, and no multiple of one."""


@pytest.fixture(scope="module")
def poses():
    """Of single precision: contacts, angles and frictions, on the bump."""
    x, angles = drawn(UGVParams(), "float32", COUNT)
    return Track.bump().astype("float32"), x, angles, jnp.linspace(0.1, 0.9, COUNT, dtype=x.dtype)


@pytest.fixture(scope="module")
def found(poses):
    track, x, angles, friction = poses
    return equilibrium(UGVParams(), track, x, angles, friction)


def test_the_compiled_program_is_one_kernel(poses):
    track, x, angles, friction = poses
    lowered = poses_at.lower(_held, (NEWTON,), UGVParams(), track, x, angles, friction)
    assert f'{MARK}="true"' in lowered.compile().as_text()


def test_a_batch_gives_what_the_elementwise_functions_give(poses, found):
    track, x, angles, friction = poses

    def elementwise(x, angles, friction):
        params = UGVParams()
        return balance(params, place(params, track, x, angles, NEWTON), friction)

    wanted = jax.jit(elementwise)(x, angles, friction)
    np.testing.assert_array_equal(found.status, wanted.status)
    scale = UGVParams().weight
    assert_same(found, wanted, rtol=2e-5, atol=2e-5 * scale)


def test_vehicles_and_frictions_of_any_shape_that_broadcasts(poses):
    track, x, angles, _ = poses
    x, angles = x[:6].reshape(2, 3), angles[:3]
    vehicle = UGVParams(wheel_mass=np.array([[50.0], [70.0]], np.float32))
    mu = np.float32([0.2, 0.5, 0.8])
    held = jax.eval_shape(lambda: equilibrium(vehicle, track, x, angles, mu))
    assert held.torque.shape == (2, 3)
    assert held.leg_torques.shape == (2, 3, 2)
    wide = np.full((4, 1, 1), 0.5, np.float32)
    wider = jax.eval_shape(lambda: equilibrium(UGVParams(), track, x, angles, wide))
    assert wider.grip_rear.shape == (4, 2, 3)
    assert wider.torque.shape == (2, 3)


def test_vehicles_in_a_column_are_each_put_at_every_place(poses):
    track, x, angles, _ = poses
    x, angles = x[:3], angles[:3]
    radii = np.array([[0.3], [0.28]], np.float32)
    held = equilibrium(UGVParams(wheel_radius=radii), track, x, angles)
    assert held.torque.shape == (2, 3)
    alone = equilibrium(UGVParams(wheel_radius=radii[1, 0]), track, x, angles)
    np.testing.assert_allclose(held.torque[1], alone.torque, rtol=1e-4, atol=0.01)
    pair = UGVParams(wheel_radius=radii[:, 0])
    with pytest.raises(ValueError, match=r"not broadcast: x_front \(3,\).*wheel_radius \(2,\)"):
        equilibrium(pair, track, x, angles)


def test_ground_that_is_a_batch_stays_elementwise(poses):
    _, x, angles, _ = poses
    heights = jnp.linspace(0.0, 0.1, 3, dtype=x.dtype)[:, None]
    x, angles = x[:1], angles[:1]

    def torque(height):
        return equilibrium(UGVParams(), Track.bump(height), x, angles, 0.8).torque

    # One shape for each: what one pose gives is not one number.
    assert jax.eval_shape(jax.vmap(torque), heights).shape == (3, 1)
