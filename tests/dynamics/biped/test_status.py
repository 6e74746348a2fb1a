"""Every way out of the model is named, and the numbers beside it stay finite."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene, Status
from stickslip.dynamics.biped import SUPPORT_END, BipedState, Euler, RK4Split, simulate, step
from tests.dynamics.biped.helpers import default_model, default_params, forward, model_of, state_of


def at(theta, rate=0.0, velocity=0.0, torque=0.0, mu_static=0.5, mu_kinetic=0.4, model=None):
    return forward(model or default_model(), theta, rate, velocity, torque, mu_static, mu_kinetic)


def move(state, torque, size=0.01, mu=0.5, model=None):
    scene = Scene.uniform(jnp.asarray(mu), jnp.asarray(mu))
    torque, size = jnp.asarray(torque), jnp.asarray(size)
    return step(model or default_model(), scene, state, torque, size)


def assert_finite(tree):
    for leaf in jax.tree.leaves(tree):
        assert np.all(np.isfinite(leaf))


def test_statuses_after_slip_onset_are_terminal():
    assert [status.name for status in Status if not status.terminal] == ["OK", "SLIP_ONSET"]


def walk_off(torque, floor=(0.5, 0.4), dtype="float64"):
    """From rest for 0.8 s, a step's time at 1 N m."""
    scene = Scene.uniform(*(jnp.asarray(mu, dtype) for mu in floor))
    torques = jnp.full(200, torque, dtype)
    return simulate(default_model(dtype=dtype), scene, state_of(dtype), torques, 0.8, 0.004)


def test_both_precisions_end_a_walk_alike(float64):
    found = set()
    for torque in (0.9, 1.1, 1.5, 3.0, -1.5):
        single, double = (walk_off(torque, dtype=dtype) for dtype in ("float32", "float64"))
        assert single.status == double.status
        assert float(single.final.time) == pytest.approx(float(double.final.time), abs=1e-4)
        found.add(double.status.terminal)
    assert found == {True, False}


def test_one_newton_metre_leans_to_the_heel_and_a_tenth_more_topples(float64):
    lean, fall = walk_off(1.0), walk_off(1.1)
    assert not lean.status > Status.SLIP_ONSET
    assert float(jnp.min(lean.contacts.zmp)) / 0.03 == pytest.approx(-7.8, abs=0.05)
    assert int(fall.status) == Status.TOPPLE
    assert float(fall.contacts.zmp[-1]) < -0.24
    assert float(fall.final.time) < 0.7


@pytest.mark.parametrize(("edge", "torque"), [("heel", 2.0), ("toe", -2.0)])
def test_the_edge_towards_which_it_leans_is_what_counts(float64, edge, torque):
    feet = dict.fromkeys(("heel", "toe"), jnp.asarray(0.5))
    lean = float(at(np.pi / 2, torque=torque, model=default_model().replace(**feet)).zmp)
    assert (lean < 0) == (edge == "heel")
    for share, status in ((0.99, Status.TOPPLE), (1.01, Status.OK)):
        model = default_model().replace(**feet | {edge: jnp.asarray(share * abs(lean))})
        assert int(at(np.pi / 2, torque=torque, model=model).status) == status


def test_a_fast_crank_lifts_the_foot_off(float64):
    now = at(np.pi, rate=15.0)
    assert float(now.normal_force) < 0
    assert int(now.status) == Status.LIFT_OFF
    before = state_of(phase=np.pi, crank_rate=15.0)
    after, contact = move(before, 0.0)
    assert int(contact.status) == Status.LIFT_OFF
    jax.tree.map(np.testing.assert_array_equal, after, before)  # it has not moved
    assert_finite((after, contact))


def test_a_foot_that_nothing_presses_down_for_a_moment_lifts_off(float64):
    """The normal force dips below 0 for 1.5 ms before the exchange of support; then it is 18 N."""
    scene = Scene.uniform(jnp.asarray(0.097), jnp.asarray(0.0873), outputs="state")
    start = BipedState(phase=jnp.asarray(2.88), crank_rate=jnp.asarray(5.3))
    walked = simulate(default_model(), scene, start, 1.8, 0.2, 0.005)
    assert Status(int(walked.status)) == Status.LIFT_OFF
    assert float(walked.final.time) == pytest.approx(0.1622049, abs=1e-5)
    assert abs(float(walked.contacts.normal_force[-1])) < 1e-4


def test_half_a_support_phase_in_one_step_is_too_long_a_step(float64):
    """At a phase where the normal force is positive at any rate."""
    scene, before = Scene.grip(outputs="state"), state_of(phase=2.3, crank_rate=200.0)
    sizes = jnp.asarray(0.0078), jnp.asarray(0.0079)  # around pi/2 over 200 rad/s
    go = [step(default_model(), scene, before, jnp.asarray(0.0), size) for size in sizes]
    assert [int(contact.status) == Status.NOT_CONVERGED for _, contact in go] == [False, True]
    after, contact = go[1]
    assert_finite((after, contact))


@pytest.mark.parametrize("integrator", [Euler(2), RK4Split()])
def test_an_infinite_time_step_is_non_finite(float64, integrator):
    states = replace(state_of(), phase=2.0, crank_rate=jnp.asarray([0.0, 3.0]))

    def long_step(state, size):
        scene = Scene.uniform(0.1, 0.06)
        return step(default_model(), scene, state, 0.9, size, integrator=integrator)

    axes = (BipedState(None, None, 0, None, None, None), None)
    after, contact = jax.jit(jax.vmap(long_step, axes))(states, jnp.inf)
    assert np.all(contact.status == Status.NON_FINITE)
    np.testing.assert_array_equal(after.phase, 2.0)
    np.testing.assert_array_equal(after.crank_rate, states.crank_rate)


def test_a_traced_linkage_that_cannot_close_has_no_solution(float64):
    params = replace(default_params(), femur_pin=jnp.asarray(0.02))
    model = model_of(params)
    assert not model.closes
    after, contact = move(state_of(), 0.5, model=model)
    assert int(contact.status) == Status.NO_SOLUTION
    assert_finite((after, contact))


def test_after_the_end_the_last_state_and_contact_stand(float64):
    torque, scene = jnp.full(200, 1.05), Scene.uniform(jnp.asarray(0.5), jnp.asarray(0.5))
    trajectory = simulate(default_model(), scene, state_of(), torque, 2.0, 0.01)
    status = np.asarray(trajectory.contacts.status)
    assert int(trajectory.status) > Status.SLIP_ONSET
    first = int(np.argmax(status > Status.SLIP_ONSET))
    assert 0 < first < 150
    assert np.all(status[first:] == status[first])
    for leaf in jax.tree.leaves(trajectory.states):
        assert np.all(leaf[first + 1 :] == leaf[-1])
    assert float(trajectory.final.time) < 2.0
    assert_finite(trajectory)


@pytest.mark.parametrize("rate", [5.0, -5.0])
def test_one_step_completes_at_either_end(float64, rate):
    scene = Scene.grip(steps="one", outputs="state")
    begin = state_of(phase=SUPPORT_END - 0.02 if rate > 0 else np.pi / 2 + 0.02, crank_rate=rate)
    after, contact = step(default_model(), scene, begin, jnp.asarray(0.0), jnp.asarray(0.01))
    assert int(contact.status) == Status.STEP_COMPLETE
    end = SUPPORT_END if rate > 0 else np.pi / 2
    np.testing.assert_allclose(after.phase, end, atol=1e-9)
    assert int(after.steps) == 0
    assert 0.003 < float(after.time) < 0.005
