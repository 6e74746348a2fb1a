"""The return of an episode is minus the optimiser's objective on the same track and waypoints."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.ugv import Track, UGVParams
from stickslip.dynamics.ugv.ground.surface import Surface
from stickslip.envs import UGVEnv
from stickslip.envs.ugv.randomisation import RandomTrack, UGVRandomisation
from stickslip.optim import CRITERIA, PostureProblem
from tests.envs.ugv.helpers import actions, drive, path_of, task

LOSSY = UGVParams(
    rolling_resistance=0.03, drive_efficiency=0.8, regeneration_efficiency=0.6, holding_loss=2e-3
)


CASES = [*((one, None) for one in CRITERIA), ("total_energy", LOSSY)]


@pytest.mark.parametrize(
    ("criterion", "vehicle"),
    [pytest.param(*CASES[0]), *(pytest.param(*one, marks=pytest.mark.long) for one in CASES[1:])],
)
def test_the_return_is_minus_the_objective(float64, criterion, vehicle):
    env, usual = task(dtype="float64", criterion=criterion)
    params = usual.replace(vehicle=vehicle or usual.vehicle)
    run = drive(env, params, actions(int(params.steps), scale=0.5))
    assert run.truncated[-1]
    assert not run.over[:-1].any()
    problem = env.problem(run.first_state, params)
    value = problem.objective(path_of(run))
    assert run.reward.sum() == pytest.approx(-value, rel=1e-11)
    assert run.info["episode_return"][-1] == pytest.approx(-value, rel=1e-11)
    assert run.info["episode_cost"][-1] == pytest.approx(value, rel=1e-11)
    assert problem.is_feasible(path_of(run))
    assert (params.failure_penalty > usual.failure_penalty) == (vehicle is LOSSY)


def test_in_single_precision_too():
    env, params = task()
    run = drive(env, params, actions(int(params.steps), scale=0.5))
    value = env.problem(run.first_state, params).objective(path_of(run))
    assert run.reward.dtype == np.float32
    assert run.reward.sum() == pytest.approx(-value, rel=2e-4)


@pytest.mark.long
def test_on_drawn_ground_and_friction_too(float64):
    env, params = task("random", "float64")
    given = actions(int(params.steps), scale=0.2)
    whole = 0
    for seed in range(4):
        run = drive(env, params, given, seed)
        end = int(np.argmax(run.over))
        if not run.truncated[end]:
            continue
        whole += 1
        problem = env.problem(run.first_state, params)
        value = problem.objective(path_of(run))
        assert run.reward.sum() == pytest.approx(-value, rel=1e-9)
        assert problem.is_feasible(path_of(run))
    assert whole > 0


def test_the_waypoints_are_those_of_the_problem(float64):
    env, params = task(dtype="float64")
    x = PostureProblem.along(params.track).x
    np.testing.assert_allclose(params.waypoints(), x, rtol=1e-12)
    run = drive(env, params, actions(int(params.steps), scale=0.1))
    np.testing.assert_allclose(run.state.station.x, x[1:], rtol=1e-12)


def test_the_reward_is_the_penalty_where_a_step_fails_and_more_than_any_drive_costs():
    env, params = task()
    slippery = params.replace(friction=0.02)
    run = drive(env, slippery, actions(int(params.steps), scale=0.2))
    end = int(np.argmax(run.over))
    assert run.terminated[end]
    assert run.reward[end] == -float(slippery.failure_penalty)  # the default one, for its friction
    assert run.info["episode_cost"][end] == run.state.cost[end - 1]
    whole = drive(env, params, actions(int(params.steps)))
    assert whole.truncated[-1]
    assert whole.info["episode_cost"][-1] < float(params.failure_penalty)


def test_the_penalty_is_of_the_best_grip_along_the_ground():
    make = UGVEnv(criterion="grip").make_params
    patched = replace(Track.flat(), surface=Surface.patches([4.0], [5.0, 0.2]))
    drawn = UGVRandomisation(track=RandomTrack((0.05, 0.1), grip=(0.1, 5.0), patch_length=(1, 2)))
    for changes in ({"track": patched}, {"randomisation": drawn}):
        found = make(friction=0.8, **changes).failure_penalty
        assert float(found) == pytest.approx(float(make(friction=4.0).failure_penalty))


def test_a_first_step_that_fails_adds_nothing_to_a_worst_value_either():
    env, params = task(criterion="peak_torque")
    first = drive(env, params.replace(friction=0.0), actions(5))
    assert first.terminated[0]
    assert first.info["episode_cost"][0] == 0
    assert first.reward[0] == -float(params.replace(friction=0.0).failure_penalty)


def test_forces_are_seen_in_weights_and_torque_in_weight_times_radius():
    env, params = task()
    run = drive(env, params, actions(int(params.steps), scale=0.5))
    at, vehicle = run.state.station, params.vehicle
    weight = 9.81 * float(2 * vehicle.wheel_mass + 2 * vehicle.leg_mass + vehicle.body_mass)
    torque = run.info["torque"] / (weight * float(vehicle.wheel_radius))
    rear, front = (
        (at.friction * normal - np.abs(force)) / weight
        for normal, force in ((at.N_rear, at.F_rear), (at.N_front, at.F_front))
    )
    assert np.abs(torque).max() > 0.01
    assert np.abs(rear - front).max() > 0.01
    straight = [run.info["rear_angle"] - np.pi / 2, run.info["front_angle"] - np.pi / 2]
    seen = [*straight, run.info["pitch"], torque, rear, front]
    np.testing.assert_allclose(run.obs[:, [0, 1, 2, 5, 6, 7]], np.stack(seen, -1), atol=2e-6)


def test_the_scale_multiplies_the_whole_reward():
    env, params = task()
    given = actions(5)
    one = drive(env, params, given).reward
    tenth = drive(env, params.replace(reward_scale=0.1), given).reward
    np.testing.assert_allclose(tenth, 0.1 * one, rtol=1e-5)


@pytest.mark.long
def test_gradients_through_a_step_are_finite_and_right(float64):
    env, params = task(dtype="float64", criterion="total_energy")
    state = env.reset(jax.random.key(0), params)[1]

    @jax.jit
    def reward(given):
        return env.step_env(state, given, params)[2]

    given, h = jnp.asarray([0.3, -0.2]), 1e-6
    slope = jax.jit(jax.grad(reward))(given)
    assert np.isfinite(slope).all()
    for leg in range(2):
        change = h * jnp.eye(2)[leg]
        difference = (reward(given + change) - reward(given - change)) / (2 * h)
        assert slope[leg] == pytest.approx(float(difference), rel=1e-5, abs=1e-5)
