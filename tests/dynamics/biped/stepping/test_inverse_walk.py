"""A prescribed crank motion over a floor that slips: the flow chart of Fig. 16."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene, Status
from stickslip.dynamics.biped import EventExact, RK4Split, inverse_dynamics, simulate_inverse
from tests.dynamics.biped.helpers import default_model, default_params, inertia_along, state_of

RATE = 3.0
EVENTS = RK4Split(record_events=True)
COUNT, DURATION = 400, 2 * np.pi / RATE
"""Two steps of the biped."""


def walk(mu_static, mu_kinetic, rate=RATE, acceleration=0.0, foot_velocity=0.0):
    """From the exchange, two steps at 3 rad/s; one compilation for all of them."""
    scene = Scene.uniform(jnp.asarray(mu_static), jnp.asarray(mu_kinetic))
    phase = np.pi / 2 if rate > 0 else 3 * np.pi / 2
    state = state_of(phase=phase, crank_rate=rate, foot_velocity=foot_velocity)
    accelerations = jnp.full(COUNT, acceleration)
    return simulate_inverse(
        default_model(), scene, state, accelerations, DURATION, DURATION / COUNT, integrator=EVENTS
    )


def test_without_slip_the_torque_is_that_of_inverse_dynamics(float64):
    walked = walk(0.5, 0.4)
    states = walked.states
    assert np.all(np.asarray(states.foot_position) == 0)
    np.testing.assert_allclose(states.crank_angle, np.pi / 2 + RATE * states.time, atol=1e-9)
    needed = jax.jit(jax.vmap(lambda theta: inverse_dynamics(default_params(), theta, RATE, 0.0)))
    expected = needed(states.phase[1:])
    np.testing.assert_allclose(walked.torques, expected.torque, atol=1e-8)
    np.testing.assert_allclose(walked.contacts.normal_force, expected.normal_force, rtol=1e-8)
    np.testing.assert_allclose(walked.contacts.friction_force, expected.friction_force, atol=1e-7)


def test_the_least_friction_without_slip_is_where_slip_begins(float64):
    """Demand |f / N| along the step against the simulated walk, just above and just below it."""
    angles = np.linspace(np.pi / 2, 3 * np.pi / 2, 4001)
    *_, dP, _, dY = inertia_along(default_params(), angles)
    params = default_params()
    normal = float(params.total_mass * params.gravity) + dY * RATE**2
    demand = np.max(np.abs(dP * RATE**2) / normal)
    assert 0.07 < demand < 0.09  # the chapter: 0.08
    assert int(walk(demand * 1.0001, demand * 1.0001).status) == Status.OK
    slips = walk(demand * 0.999, demand * 0.999)
    assert int(slips.status) == Status.SLIP_ONSET
    first = slips.events()[0]
    assert first[1] == "slip"
    worst = angles[np.argmax(np.abs(dP * RATE**2) / normal)]
    assert (first[2] - np.pi / 2) % np.pi == pytest.approx(worst - np.pi / 2, abs=0.1)


@pytest.mark.parametrize("rtol", [1e-7, 1e-11])
def test_slip_begins_at_the_very_instant_whatever_the_tolerance(float64, rtol):
    how = EventExact(rtol=rtol, atol=1e-14, record_events=True)
    state = state_of(phase=np.pi / 2 + 0.01, crank_rate=3.1)
    walked = simulate_inverse(
        default_model(), Scene.uniform(0.07, 0.056), state, 0.0, 1.0, 1.0, integrator=how
    )

    def spare(at):
        inertia = default_model().inertia.at(state.phase + 3.1 * at)
        normal = default_model().total_mass * default_model().gravity + inertia.dY * 3.1**2
        return float(0.07 * normal - abs(inertia.dP) * 3.1**2)

    begun = [at for at, kind, _ in walked.events() if kind == "slip" and spare(at - 1e-3) > 0]
    assert begun
    assert all(spare(at - 1e-9) > 0 > spare(at + 1e-9) for at in begun)


@pytest.mark.parametrize("rate", [RATE, -RATE])
def test_the_motor_s_work_is_the_change_of_energy_and_what_friction_takes(float64, rate):
    walked = walk(0.05, 0.04, rate, 0.3 * np.sign(rate))
    assert int(walked.contacts.switches.sum()) >= 4
    model, states = default_model(), walked.states
    M, _, P, _, _, _ = jax.vmap(model.inertia.at)(states.phase)
    height = jax.vmap(model.inertia.moment_at)(states.phase).Y
    w, v = states.crank_rate, states.foot_velocity
    energy = (M * w**2 + 2 * P * w * v + model.total_mass * v**2) / 2 + model.gravity * height
    work = float(walked.contacts.work.sum())
    slide = np.asarray(walked.states.foot_position)
    force = np.asarray(walked.contacts.friction_force)
    power = np.concatenate([[0.0], force * np.asarray(v)[1:]])
    lost = -np.trapezoid(power, np.asarray(states.time))
    assert np.abs(slide).max() > 1e-3
    assert lost > 0.005
    assert work - float(energy[-1] - energy[0]) == pytest.approx(lost, rel=0.02)
