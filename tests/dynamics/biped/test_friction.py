"""Coulomb's law at every instant of random walks, and at random instants."""

from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip.dynamics import Scene, Status
from stickslip.dynamics.biped import BipedState, simulate
from tests.dynamics.biped.helpers import (
    default_model,
    default_params,
    forward,
    inverse,
    sliding_forces,
    state_of,
    still_forces,
)

WALKS, STEPS, SIZE = 24, 200, 0.005


@lru_cache
def random_walks():
    """Walks under torques drawn anew every step, on floors from ice to rubber; flat arrays of the
    running steps: before and after, torque, contact, friction coefficients."""
    rng = np.random.default_rng(7)
    mu_static = rng.uniform(0.03, 0.6, WALKS)
    mu_kinetic = mu_static * rng.uniform(0.5, 1.0, WALKS)
    torques = jnp.asarray(rng.uniform(-1.5, 2.5, (WALKS, STEPS)).repeat(5, axis=1)[:, :STEPS])
    phases = jnp.asarray(rng.uniform(1.6, 4.7, WALKS))
    rates = jnp.asarray(rng.uniform(-4, 6, WALKS))
    model = default_model()

    def run(phase, rate, torque, static, kinetic):
        scene = Scene.uniform(static, kinetic, outputs="state")
        state = BipedState(**(vars(state_of()) | {"phase": phase, "crank_rate": rate}))
        return simulate(model, scene, state, torque, STEPS * SIZE, SIZE)

    walks = jax.jit(jax.vmap(run))(
        phases, rates, torques, jnp.asarray(mu_static), jnp.asarray(mu_kinetic)
    )
    walks = jax.tree.map(np.asarray, walks)
    running = walks.contacts.status <= Status.SLIP_ONSET
    keep = [
        leaf[running]
        for leaf in np.broadcast_arrays(mu_static[:, None], mu_kinetic[:, None], running)[:2]
    ]
    before = jax.tree.map(lambda leaf: leaf[:, :-1][running], walks.states)
    after = jax.tree.map(lambda leaf: leaf[:, 1:][running], walks.states)
    contact = jax.tree.map(lambda leaf: leaf[running], walks.contacts)
    return before, after, walks.torques[running], contact, *keep


def test_random_walks_slip_stick_and_walk(float64):
    """The tests below are about something."""
    _, after, _, contact, *_ = random_walks()
    assert np.sum(contact.mode == 0) > 300
    assert np.sum(contact.mode == 1) > 100
    assert np.sum(contact.mode == -1) > 100
    assert np.sum(contact.status == Status.SLIP_ONSET) > 50
    assert len(np.unique(after.steps)) > 3


def test_sticking_friction_is_what_holds_the_foot_and_inside_the_cone(float64):
    _, after, torque, contact, mu_static, _ = random_walks()
    sticks = contact.mode == 0
    f, N = still_forces(
        default_params(), after.phase[sticks], after.crank_rate[sticks], torque[sticks]
    )
    np.testing.assert_allclose(contact.friction_force[sticks], f, atol=1e-9)
    np.testing.assert_allclose(contact.normal_force[sticks], N, rtol=1e-11)
    assert np.all(np.abs(f) <= mu_static[sticks] * N * (1 + 1e-9))


def test_sliding_friction_opposes_the_slide_with_mu_kinetic_times_normal_force(float64):
    _, after, torque, contact, _, mu_kinetic = random_walks()
    slides = contact.mode != 0
    direction = np.sign(after.foot_velocity[slides])
    np.testing.assert_array_equal(contact.mode[slides], direction)
    f, N = sliding_forces(
        default_params(),
        after.phase[slides],
        after.crank_rate[slides],
        torque[slides],
        direction * mu_kinetic[slides],
    )
    np.testing.assert_allclose(contact.friction_force[slides], f, rtol=1e-10)
    np.testing.assert_allclose(contact.normal_force[slides], N, rtol=1e-10)
    np.testing.assert_allclose(f, -direction * mu_kinetic[slides] * N, rtol=1e-12)


def test_a_foot_breaks_loose_against_the_force_that_held_it(float64):
    before, after, torque, contact, *_ = random_walks()
    onset = (contact.switches == 1) & (contact.status == Status.SLIP_ONSET)
    onset &= before.foot_velocity == 0
    assert np.sum(onset) > 30
    f, _ = still_forces(
        default_params(), before.phase[onset], before.crank_rate[onset], torque[onset]
    )
    np.testing.assert_array_equal(np.sign(after.foot_velocity[onset]), -np.sign(f))


INSTANTS = {
    "theta": st.floats(np.pi / 2, 3 * np.pi / 2),
    "rate": st.floats(-5, 5),
    "torque": st.floats(-4, 4),
    "mu_static": st.floats(0, 1.2),
    "ratio": st.floats(0, 1),
}


@given(**INSTANTS, velocity=st.sampled_from([-0.3, 0.0, 0.0, 1e-9, 0.2]))
def test_forward_dynamics_obeys_coulomb_and_inverts_inverse_dynamics(
    float64, theta, rate, torque, mu_static, ratio, velocity
):
    params, mu_kinetic = default_params(), mu_static * ratio
    now = forward(params, theta, rate, velocity, torque, mu_static, mu_kinetic)
    if int(now.status) == Status.NO_SOLUTION:
        assert mu_kinetic > 1.29  # MODEL 1.4: not below
    f, N, mode = float(now.friction_force), float(now.normal_force), int(now.mode)
    if mode == 0:
        assert velocity == 0
        assert float(now.foot_acceleration) == 0
        assert abs(f) <= mu_static * N
    else:
        assert f == pytest.approx(-mode * mu_kinetic * N, rel=1e-12, abs=1e-12)
        assert mode == np.sign(velocity or float(now.foot_acceleration)) or N <= 0
    asked = inverse(params, theta, rate, now.crank_acceleration, velocity, now.foot_acceleration)
    assert float(asked.torque) == pytest.approx(torque, abs=1e-10)
    assert float(asked.friction_force) == pytest.approx(f, abs=1e-9)
    assert float(asked.normal_force) == pytest.approx(N, abs=1e-9)
    assert float(asked.zmp) == pytest.approx(float(now.zmp), rel=1e-9, abs=1e-9)
