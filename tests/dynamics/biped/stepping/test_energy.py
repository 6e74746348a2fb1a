"""Energy changes by the motor's work, and by friction's where the foot slides."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from stickslip.dynamics import Scene, Status
from stickslip.dynamics.biped import BipedState, Euler, EventExact, simulate, simulate_inverse
from tests.dynamics.biped.helpers import default_model, default_params, exact_along, state_of, walk


def energies(states: BipedState) -> np.ndarray:
    """Kinetic and potential energy along a walk, from the exact functions (MODEL 1.4)."""
    params = default_params()
    phases, rates, slips = map(np.asarray, (states.phase, states.crank_rate, states.foot_velocity))
    (M, _, P, *_), moment = exact_along(params, phases)
    potential = float(np.asarray(params.gravity)) * moment.Y
    moving = M * rates**2 / 2 + P * rates * slips + float(params.total_mass) * slips**2 / 2
    return moving + potential


@pytest.mark.long
def test_energy_balance_over_ten_steps_of_walking(float64):
    scene = Scene.grip(outputs="state")
    begin = state_of(crank_rate=3.0)
    held = (lambda state: 5.0 * (3.0 - state.crank_rate)), 11.0, 0.001  # at about 3 rad/s
    trajectory = simulate(default_model(), scene, begin, *held)
    assert int(trajectory.status) == 0
    assert int(trajectory.final.steps) >= 10
    energy = energies(trajectory.states)
    work = np.concatenate([[0.0], np.cumsum(trajectory.contacts.work)])
    turned = np.sum(trajectory.contacts.positive_work)
    assert np.max(np.abs(energy - energy[0] - work)) < 1e-9 * turned


@pytest.mark.parametrize("index", range(6))
def test_friction_creates_no_energy(float64, reference, index):
    """In no step of a reference trajectory, but for the integrator's error."""
    trajectory = walk(reference["trajectories"][index], 3200)
    gained = np.diff(energies(trajectory.states)) - np.asarray(trajectory.contacts.work)
    assert np.max(gained) < 1e-9
    slid = np.asarray(trajectory.contacts.slide_distance) > 1e-9
    assert np.all(gained[slid] < 0)


def test_work_is_torque_times_angle_and_positive_work_counts_gifts_only(float64, reference):
    case = reference["trajectories"][3]
    trajectory = walk(case, 3200)
    turned = np.diff(np.asarray(trajectory.states.crank_angle))
    np.testing.assert_allclose(trajectory.contacts.work, case["torque"] * turned, atol=1e-14)
    gifts = np.sum(np.maximum(case["torque"] * turned, 0.0))
    np.testing.assert_allclose(np.sum(trajectory.contacts.positive_work), gifts, rtol=1e-5)


def test_positive_work_is_right_where_the_crank_turns_back_within_a_step(float64):
    """Under a constant torque: its product with the way turned in its direction."""
    given = default_model(), Scene.grip(outputs="state"), state_of(phase=4.0, crank_rate=-2.5), 0.5
    coarse, fine = (simulate(*given, 0.1, dt) for dt in (0.05, 0.0005))
    wanted = 0.5 * (fine.final.crank_angle - np.min(fine.states.crank_angle))
    np.testing.assert_allclose(np.sum(coarse.contacts.positive_work), wanted, rtol=0.01)


@pytest.mark.long
def test_positive_work_and_its_slope_follow_the_adaptive_tolerance(float64):
    def given(rate, dt=0.1):
        begin = replace(state_of(phase=4.0), crank_rate=rate)
        walk = simulate(default_model(), Scene.grip(), begin, 0.5, 0.1, dt, integrator=EventExact())
        return walk.contacts.positive_work.sum()

    found, slope = jax.value_and_grad(given)(-2.4)
    low, wanted, high = jax.vmap(lambda rate: given(rate, 2e-4))(np.array([-2.401, -2.4, -2.399]))
    np.testing.assert_allclose([found, slope], [wanted, (high - low) / 2e-3], rtol=1e-3)


def test_positive_work_of_a_prescribed_motion_is_what_the_motor_gives(float64):
    given = default_model(), Scene.grip(outputs="state"), state_of(crank_rate=3.0), 0.0, 1.0
    coarse, fine = (simulate_inverse(*given, dt) for dt in (0.02, 0.0005))
    power = 3.0 * np.maximum(fine.torques, 0.0)
    wanted = np.trapezoid(power, dx=0.0005) + 0.00025 * power[0]  # from the start on
    np.testing.assert_allclose(np.sum(coarse.contacts.positive_work), wanted, rtol=2e-4)


def test_sums_over_a_walk_that_falls_are_those_up_to_the_fall(float64):
    """It slides and topples: nothing is done in the steps that are left."""
    begin, scene = state_of(phase=4.0, crank_rate=3.0), Scene.uniform(0.1, 0.05)
    fallen = simulate(default_model(), scene, begin, 2.0, 0.5, 0.002, integrator=Euler())
    assert int(fallen.status) == Status.TOPPLE
    assert 0 < float(fallen.final.time) < 0.1
    slid, done = fallen.contacts.slide_distance, fallen.contacts.work
    path = np.abs(np.diff(np.asarray(fallen.states.foot_position)))
    assert float(np.sum(slid)) == pytest.approx(np.sum(path), rel=1e-12)
    assert float(np.sum(done)) == pytest.approx(2 * (float(fallen.final.crank_angle) - 4))
    assert float(np.sum(fallen.contacts.positive_work)) == pytest.approx(float(np.sum(done)))
