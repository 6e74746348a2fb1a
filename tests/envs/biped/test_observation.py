"""The biped's observation: entries, order, units and bounds of its docstring."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.envs import BipedEnv, BipedEnvParams, Randomisation
from tests.envs.helpers import actions, options, rollout, task

ALL = [("default", 0.2), ("patches", 0.25)]
ALL += [pytest.param(name, 0.3, marks=pytest.mark.long) for name in ("random", "one")]


@pytest.mark.parametrize(("name", "scale"), ALL)
def test_the_entries_are_the_documented_ones_in_order(name, scale):
    env, params = task(name)
    run = rollout(env, params, actions(scale))
    state, obs = run.state, run.obs
    documented = [
        np.cos(2 * state.biped.phase),
        np.sin(2 * state.biped.phase),
        state.biped.crank_rate,
        state.biped.foot_velocity,
        state.mode == 0,
        state.drawn.mean_rate,
    ]
    for entry, expected in enumerate(documented):
        np.testing.assert_allclose(obs[..., entry], expected, rtol=1e-5, atol=1e-5)
    assert np.all(obs[obs[..., 4] == 1][:, 3] == 0)  # a foot at rest has no velocity
    if name != "one":
        assert set(np.unique(obs[..., 4])) == {0.0, 1.0}


def test_the_next_patch_and_the_friction_underfoot_are_those_of_the_floor():
    env, params = task("patches")
    run = rollout(env, params, actions(0.25))
    biped, floor = run.state.biped, params.scene.floor
    place = biped.steps * float(params.robot.step_length) + biped.foot_position
    edges, mu_static = np.asarray(floor.edges), np.asarray(floor.mu_static)
    away = np.min(np.abs(place[..., None] - edges), axis=-1) > 1e-5
    here = np.searchsorted(edges, place)
    ahead = np.append(edges, np.inf)[here] - place
    distance, next_mu, mu, mu_kinetic = np.moveaxis(run.obs[..., 6:], -1, 0)
    assert len(np.unique(here[away])) > 1
    np.testing.assert_allclose(distance[away], np.minimum(ahead, 10.0)[away], atol=1e-6)
    assert np.array_equal(next_mu[away], mu_static[np.minimum(here + 1, len(edges))][away])
    assert np.array_equal(mu[away], mu_static[here][away])
    assert np.array_equal(mu_kinetic[away], np.asarray(floor.mu_kinetic)[here][away])


def test_past_the_last_patch_nothing_is_in_sight():
    scene = Scene.patches(np.asarray([-2.0, -1.0]), np.asarray([0.5, 0.05, 0.1]))
    env = BipedEnv(see_patch=True)
    obs, _ = env.reset(jax.random.key(0), env.make_params(scene=scene))
    assert obs.shape == (8,)
    assert obs[6] == 10.0
    assert obs[7] == pytest.approx(0.1)


@pytest.mark.parametrize(("name", "scale"), ALL)
@pytest.mark.parametrize("hard", [False, True])
def test_no_observation_leaves_its_bounds(name, scale, hard):
    env, params = task(name)
    changes = {"torque_limit": 30.0, "max_crank_rate": 5.0} if hard else {}
    params = params.replace(**changes)
    low, high = env.observation_bounds(params)
    run = rollout(env, params, actions(1.0 if hard else scale))
    assert run.over.any()
    for obs in (run.first_obs, run.obs, run.info["final_obs"]):
        assert np.all(np.isfinite(obs))
        assert np.all(obs >= low.astype(np.float32))
        assert np.all(obs <= high.astype(np.float32))
    assert high[2] == (5.0 if hard else 20.0)


@pytest.mark.parametrize(
    "changes",
    [
        {"mean_rate": 30.0},
        {"scene": Scene.uniform(50.0, 20.0)},
        {"scene": Scene.patches(np.asarray([0.1]), np.asarray([11.0, 12.0]))},
        {"scene": Scene.patches(np.asarray([1e4]), np.asarray([0.1, 0.2]))},
    ],
)
def test_extreme_parameters_do_not_lead_out_of_the_bounds(changes):
    env = BipedEnv(see_patch=True, see_friction=True)
    params = replace(task()[1], **changes)
    obs, _ = env.reset(jax.random.key(0), params)
    low, high = env.observation_bounds(params)
    assert np.all(np.asarray(obs) >= low - 1e-6)
    assert np.all(np.asarray(obs) <= high)


def shapes(env: BipedEnv, params: BipedEnvParams):
    """Shapes and types of reset's and step's results, without compiling."""
    key = jax.eval_shape(lambda: jax.random.key(0))
    obs, state = jax.eval_shape(env.reset, key, params)
    action = jax.ShapeDtypeStruct((1,), obs.dtype)
    return obs, state, jax.eval_shape(env.step, key, state, action, params)


FLOORS = {
    "grip": Scene.grip(),
    "uniform": Scene.uniform(0.3),
    "patches": Scene.patches(np.asarray([0.5]), np.asarray([0.5, 0.1])),
}


@pytest.mark.parametrize(
    ("floor", "see_patch", "see_friction", "size"),
    [
        *[(floor, False, False, 6) for floor in FLOORS],
        *[("grip", True, True, 6), ("uniform", True, False, 6), ("uniform", True, True, 8)],
        *[("patches", True, False, 8), ("patches", False, True, 8), ("patches", True, True, 10)],
    ],
)
def test_sight_adds_its_entries_only_where_there_is_something_to_see(
    floor, see_patch, see_friction, size
):
    env = BipedEnv(see_patch=see_patch, see_friction=see_friction)
    params = env.make_params(scene=FLOORS[floor])
    obs, _, step = shapes(env, params)
    low, high = env.observation_bounds(params)
    assert obs.shape == step[0].shape == step[5]["final_obs"].shape == low.shape == high.shape
    assert obs.shape == (size,)


def test_an_encoder_alone_sees_the_angle_the_command_and_the_floor():
    env, key = BipedEnv(see_patch=True, see_motion=False), jax.random.key(3)
    params = env.make_params(scene=FLOORS["patches"], randomisation=Randomisation(phase=(2.0, 4.0)))
    whole = replace(env, see_motion=True)
    seen, every = env.reset(key, params)[0], whole.reset(key, params)[0]
    np.testing.assert_array_equal(seen, np.delete(every, [2, 3, 4]))
    bounds = zip(env.observation_bounds(params), whole.observation_bounds(params), strict=True)
    for ours, theirs in bounds:
        np.testing.assert_array_equal(ours, np.delete(theirs, [2, 3, 4]))


def test_an_encoders_errors_are_normal_and_new_in_each_step():
    env, params = task()
    run = rollout(env, params.replace(encoder_noise=0.02), actions(0.1))
    exact = 2 * np.asarray(run.state.biped.phase)
    off = np.angle(np.exp(1j * (np.arctan2(run.obs[..., 1], run.obs[..., 0]) - exact))) / 2
    assert np.std(off) == pytest.approx(0.02, rel=0.1)
    assert abs(np.mean(off)) < 0.003
    assert abs(np.corrcoef(off[:, 1:].ravel(), off[:, :-1].ravel())[0, 1]) < 0.15
    plain = rollout(env, params, actions(0.1))
    np.testing.assert_array_equal(run.obs[..., 2:], plain.obs[..., 2:])
    np.testing.assert_array_equal(run.reward, plain.reward)


@pytest.mark.parametrize("name", ["default", "random", pytest.param("one", marks=pytest.mark.long)])
def test_everything_is_computed_in_the_type_of_the_robot(dtype, name):
    sight = {key: value for key, value in options(name).items() if "see" in key}
    numbers = {key: value for key, value in options(name).items() if key not in sight}
    env = BipedEnv(**sight)
    params = jax.eval_shape(lambda: env.make_params(**numbers, dtype=dtype))
    obs, _, (again, state, reward, terminated, truncated, info) = shapes(env, params)
    assert obs.dtype == again.dtype == reward.dtype == dtype
    assert (reward.shape, terminated.shape, truncated.shape) == ((), (), ())
    assert terminated.dtype == truncated.dtype == info["autoreset"].dtype == bool
    for leaf in [*jax.tree.leaves(state), *jax.tree.leaves(info)]:
        assert leaf.dtype in (dtype, jnp.dtype("int32"), jnp.dtype(bool))
