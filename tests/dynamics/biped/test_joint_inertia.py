"""Inertia functions by the full system: the reduced ones, or what the chapter makes of them."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.biped import BipedParams, ReducedInertia
from stickslip.dynamics.biped.bodies.joint_inertia import DifferencedInertia, JointInertia
from stickslip.dynamics.biped.bodies.newton_euler import newton_euler
from tests.dynamics.biped.helpers import default_params, exact_along
from tests.dynamics.biped.joint_helpers import (
    default_robots,
    every_system,
    random_instants,
    random_robots,
    reduced_along,
)

pytestmark = pytest.mark.long


@partial(jax.jit, static_argnums=2)
def along(robots, angles, solver="groups"):
    """at, moment_at of each robot at its angle."""

    def one(params, angle):
        inertia = JointInertia(params, solver=solver)
        return inertia.at(angle), inertia.moment_at(angle)

    return jax.vmap(one)(robots, angles)


LONG = (pytest.param(name, marks=pytest.mark.long) for name in ("block", "refined"))


@pytest.mark.parametrize("solver", ["groups", *LONG])
def test_exact_motion_gives_the_reduced_functions(solver, float64):
    robots, angles = random_robots(), random_instants()["theta"]
    found, _ = along(robots, angles, solver)
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


@pytest.mark.long
def test_precision_is_that_of_what_is_given(dtype):
    inertia, moment = along(default_robots(dtype.name), random_instants(dtype=dtype.name)["theta"])
    assert all(leaf.dtype == dtype for leaf in (*inertia, *moment))


@jax.jit
def joint_forces(robots, given):
    def one(params, at):
        motion = at["theta"], at["crank_rate"], at["crank_acceleration"], at["foot_acceleration"]
        return JointInertia(params).joint_forces(*motion)

    return jax.vmap(one)(robots, given)


@pytest.mark.long
def test_joint_forces_of_a_motion_are_those_of_the_inverse_system(float64):
    robots, given = random_robots(), random_instants()
    want = every_system(robots, given)["inverse"].joint_forces
    np.testing.assert_allclose(joint_forces(robots, given), want, rtol=1e-9, atol=1e-8)


STEP = 1e-3


@jax.jit
def by_differences(robots, given):
    """The chapter's (36) with its differences, and the coefficients."""

    def one(params, at):
        found = newton_euler(
            params,
            at["theta"],
            at["crank_rate"],
            system="forward_slip",
            torque=at["torque"],
            mu_kinetic=at["mu_kinetic"],
            direction=at["direction"],
            difference_step=STEP,
        )
        inertia = JointInertia(params, STEP)
        return found, inertia.at(at["theta"]), inertia.moment_at(at["theta"])

    return jax.vmap(one)(robots, given)


def test_differenced_coefficients_say_what_the_system_says(float64):
    robots, given = random_robots(), random_instants()
    found, inertia, moment = by_differences(robots, given)
    assert isinstance(inertia, DifferencedInertia)
    mass, g, square = robots.total_mass, robots.gravity, given["crank_rate"] ** 2
    alpha, a1 = found.crank_acceleration, found.foot_acceleration
    torque = inertia.M * alpha + inertia.P_crank * a1 + inertia.dM * square / 2
    friction = inertia.P * alpha + mass * a1 + inertia.dP * square
    normal = mass * g + inertia.Y * alpha + inertia.dY * square
    turn = moment.L * alpha + moment.dL * square + g * moment.X - a1 * moment.Y
    pairs = [
        (torque + g * inertia.Y_crank, given["torque"]),
        (friction, found.friction_force),
        (normal, found.normal_force),
        (turn, found.ankle_moment),
    ]
    for got, want in pairs:
        np.testing.assert_allclose(got, want, rtol=1e-8, atol=1e-8)


def test_differences_err_in_the_momenta_and_break_virtual_power(float64):
    robots, given = default_robots(), random_instants()
    exact = reduced_along(robots, given["theta"])
    _, found, _ = by_differences(robots, given)
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


def test_unknown_solvers_are_refused():
    with pytest.raises(ValueError, match="solver = 'qr' is unknown; accepted: 'lu', 'scaled'"):
        JointInertia(BipedParams.from_bars(), solver="qr")
