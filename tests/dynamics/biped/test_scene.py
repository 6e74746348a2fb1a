"""What a scene contains does what it says; what it leaves out changes nothing."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene, Status
from stickslip.dynamics.biped import Euler, floor_position, simulate, step
from stickslip.dynamics.biped.contact import patch_at
from tests.dynamics.biped.helpers import FINE, RECORDING, default_model, default_params, state_of
from tests.trees import assert_same

COUNT = 200


def go(scene, state, torque=1.0, duration=0.8, **options):
    torques = jnp.full(COUNT, torque)
    return simulate(default_model(), scene, state, torques, duration, duration / COUNT, **options)


def uniform(mu, **options):
    return Scene.uniform(jnp.asarray(mu), jnp.asarray(mu), **options)


close = partial(assert_same, rtol=1e-12, atol=1e-14)


def test_grip_never_slips_and_is_the_limit_of_high_friction(float64):
    walk = go(Scene.grip(), state_of())
    demand = np.abs(walk.contacts.friction_force) / walk.contacts.normal_force
    assert np.max(demand) > 0.5  # a floor of 0.5 slips, see the reference
    for name in ("foot_velocity", "foot_position"):
        np.testing.assert_array_equal(getattr(walk.states, name), 0.0)
    np.testing.assert_array_equal(walk.contacts.mode, 0)
    np.testing.assert_array_equal(walk.contacts.slide_distance, 0.0)
    close(walk.states, go(uniform(1e6), state_of()).states)


def test_states_are_the_same_without_forces(float64):
    begin = state_of(phase=2.0, crank_rate=3.0)
    full, bare = (go(uniform(0.06, outputs=o), begin, 0.0) for o in ("forces", "state"))
    assert int(full.status) == Status.SLIP_ONSET
    close(full.states, bare.states)
    assert bare.contacts.zmp is None
    assert full.contacts.zmp.shape == (COUNT,)


@pytest.mark.long
def test_a_sliding_foot_takes_the_friction_of_the_side_it_is_on(float64):
    """A walk over an edge is one on the left floor up to it and one on the right floor after."""
    begin, edge, duration = state_of(phase=2.4, crank_rate=1.0, foot_velocity=0.5), 0.02, 0.1
    floor = Scene.patches([edge], [0.1, 0.02])
    whole = go(floor, begin, 0.2, duration, integrator=RECORDING)
    assert [kind for _, kind, _ in whole.events()] == ["patch"]
    time = whole.events()[0][0]
    left = go(uniform(0.1), begin, 0.2, time).final
    np.testing.assert_allclose(left.foot_position, edge, atol=1e-11)
    right = go(uniform(0.02), left, 0.2, duration - time).final
    close(whole.final, right, rtol=1e-8, atol=1e-10)
    ratio = np.asarray(whole.contacts.friction_force / whole.contacts.normal_force)
    over = np.asarray(whole.states.foot_position[1:]) > edge
    np.testing.assert_allclose(ratio[over], -0.02, rtol=1e-12)
    np.testing.assert_allclose(ratio[~over], -0.1, rtol=1e-12)


def test_a_floor_moved_by_whole_steps_is_met_as_many_steps_later(float64):
    begin, edge = {"phase": 2.4, "crank_rate": 1.0, "foot_velocity": 0.5}, 0.02
    walks = []
    for steps in (0, 3, -2):
        floor = Scene.patches([edge + steps * float(default_model().step_length)], [0.1, 0.02])
        walks.append(go(floor, state_of(**begin, steps=steps), 0.2, 0.1, integrator=RECORDING))
        assert [kind for _, kind, _ in walks[-1].events()] == ["patch"]
    first, *others = (replace(walk.contacts, events=None) for walk in walks)
    for other in others:
        close(first, other, rtol=1e-9, atol=1e-9)
    times = [walk.events()[0][0] for walk in walks]
    assert times == pytest.approx([times[0]] * 3, rel=1e-11)


def test_on_an_edge_the_patch_that_the_foot_moves_into_counts(float64):
    floor = Scene.patches([0.3, 0.6], [0.5, 0.05, 0.5]).floor
    for edge in (0, 1):
        at = jnp.asarray(floor.edges)[edge]
        found = [int(patch_at(floor, at, jnp.asarray(way))) for way in (-1.0, 0.0, 1.0)]
        assert found == [edge, edge + 1, edge + 1]


def test_ice_begins_where_the_foot_lands_on_it(float64):
    """Steps are 0.24 m: the footholds at 0.24 m and 0.72 m are dry, that at 0.48 m is ice."""
    ice = Scene.patches([0.3, 0.6], [0.5, 0.05, 0.5])
    model, torque, size = default_model(), jnp.asarray(0.0), jnp.asarray(0.004)
    for steps, mu in ((0, 0.5), (1, 0.5), (2, 0.05), (3, 0.5)):
        begin = state_of(phase=2.4, crank_rate=0.5, foot_velocity=0.01, steps=steps)
        _, contact = step(model, ice, begin, torque, size / 100)
        ratio = contact.friction_force / contact.normal_force
        np.testing.assert_allclose(ratio, -mu, rtol=1e-12)
        before = state_of(phase=4.71, crank_rate=3.0, foot_velocity=0.05, steps=steps - 1)
        after, contact = step(model, ice, before, torque, size)
        assert int(after.steps) == steps
        np.testing.assert_allclose(float(floor_position(model, after)), 0.24 * steps, atol=1e-3)
        if int(contact.mode) == 1:
            ratio = contact.friction_force / contact.normal_force
            np.testing.assert_allclose(ratio, -mu, rtol=1e-12)


@pytest.mark.long
def test_a_scene_s_payload_walks_as_the_robot_s_own_does(float64):
    params = default_params().replace(payload=jnp.asarray(0.0))  # as what is loaded: one program
    loaded, floor = params.replace(payload=jnp.asarray(2.0)), Scene.grip(outputs="state")
    scene = replace(floor, payload=2.0)
    by_scene, by_robot, bare = (
        simulate(robot, where, state_of(), 1.5, 0.05, 0.01, fidelity=FINE)
        for robot, where in ((params, scene), (loaded, floor), (params, floor))
    )
    close(by_scene, by_robot)
    assert abs(float(bare.final.phase - by_scene.final.phase)) > 1e-3


def test_torque_may_be_a_number_an_array_or_a_function_of_the_state(float64):
    number = go(Scene.grip(), state_of(), 0.9)
    function = simulate(
        default_model(), Scene.grip(), state_of(), lambda state: 0.9, 0.8, 0.8 / COUNT
    )
    close(number.states, function.states)
    np.testing.assert_array_equal(function.torques, 0.9)


def pull(gain, now):
    """Towards 3 rad/s."""
    return gain * (3.0 - now.crank_rate)


def test_the_numbers_of_a_torque_that_is_a_pytree_are_traced(float64):
    given, how = (default_model(), Scene.grip(), state_of()), {"integrator": Euler()}
    for gain in (0.2, 0.3):
        walk = simulate(*given, jax.tree_util.Partial(pull, gain), 0.02, 0.01, **how)
        assert walk.torques[0] == pytest.approx(gain * (3.0 - state_of().crank_rate))
