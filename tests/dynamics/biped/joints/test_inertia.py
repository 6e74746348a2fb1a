"""Inertia functions by the full system: the reduced ones, or what the chapter makes of them."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.biped import BipedParams, ReducedInertia
from stickslip.dynamics.biped.joints.equations import link_motion
from stickslip.dynamics.biped.joints.inertia import DifferencedInertia, JointInertia
from tests.dynamics.biped.helpers import default_params, exact_along
from tests.dynamics.biped.joints.robots import (
    default_robots,
    random_instants,
    random_robots,
    reduced_along,
)


@jax.jit
def along(robots, angles):
    """at, moment_at of each robot at its angle."""

    def one(params, angle):
        inertia = JointInertia(params)
        return inertia.at(angle), inertia.moment_at(angle)

    return jax.vmap(one)(robots, angles)


def test_exact_motion_gives_the_reduced_functions(float64):
    robots, angles = random_robots(), random_instants()["theta"]
    found, _ = along(robots, angles)
    want = reduced_along(robots, angles)
    assert isinstance(found, ReducedInertia)
    for name, got, exact in zip(want._fields, found, want, strict=True):
        size = float(jnp.max(jnp.abs(exact)))
        np.testing.assert_allclose(got, exact, rtol=1e-9, atol=1e-10 * size, err_msg=name)


def test_the_grounds_moment_is_that_of_the_reduced_functions(float64):
    params, angles = default_params(), random_instants()["theta"]
    _, found = along(default_robots(), angles)
    _, want = exact_along(params, angles)
    for name, got, exact in zip(want._fields, found, want, strict=True):
        np.testing.assert_allclose(got, exact, rtol=1e-9, atol=1e-11, err_msg=name)


STEP = 1e-3


@jax.jit
def by_differences(robots, angles):
    """The chapter's coefficients, with its differences."""
    return jax.vmap(lambda params, angle: JointInertia(params, STEP).at(angle))(robots, angles)


def test_differences_err_in_the_momenta_and_break_virtual_power(float64):
    robots, given = default_robots(), random_instants()
    exact = reduced_along(robots, given["theta"])
    found = by_differences(robots, given["theta"])
    assert isinstance(found, DifferencedInertia)
    for name in ("M", "P", "Y"):
        off = jnp.max(jnp.abs(getattr(found, name) - getattr(exact, name)))
        assert STEP * 0.1 < float(off) < STEP * 5, name
    for name in ("P", "Y"):  # the crank's: virtual power of the exact geometry
        off = getattr(found, f"{name}_crank") - getattr(exact, name)
        assert float(jnp.max(jnp.abs(off))) < 1e-12


@pytest.mark.parametrize("step", [0.0, -1e-3, 0.6, float("nan"), True, "0.01"])
def test_steps_that_are_none_are_refused(step):
    with pytest.raises(ValueError, match=r"difference_step = .*; accepted: None \(exact\) or a cr"):
        JointInertia(BipedParams.from_bars(), step)


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
