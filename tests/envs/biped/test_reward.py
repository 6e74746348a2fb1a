"""The biped's reward, information and totals are what its docstring says of the physics."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.agents.machine import machine_of_env
from stickslip.dynamics import Status
from stickslip.dynamics.biped import BODIES, kinematics
from stickslip.envs import BipedEnv
from tests.envs.helpers import RANGES, Rollout, actions, constant, rollout, task

TERMS = ("reward_tracking", "reward_slip", "reward_energy", "reward_fall")
WEIGHTS = {"tracking_weight": 1.7, "slip_weight": 0.3, "energy_weight": 0.9, "fall_penalty": 2.5}


def doubles(tree):
    return jax.tree.map(lambda of: of.astype(np.float64) if of.dtype.kind == "f" else of, tree)


@pytest.fixture(params=["random", "weighted"])
def walks(request) -> tuple:
    """Parameters and walks with falls, slips and ends in them."""
    env, params = task("random")
    if request.param == "weighted":
        params = params.replace(**WEIGHTS, copper_loss=1.3, torque_limit=3.0)
    run = doubles(rollout(env, params, actions(0.3)))
    assert run.terminated.any()
    assert run.truncated.any()
    return params, run


def close(given, expected, scale: float = 1.0):
    np.testing.assert_allclose(given, expected, rtol=2e-5, atol=2e-6 * scale)


def test_every_term_follows_from_the_physical_entries(walks):
    params, run = walks
    info, drawn, period = run.info, run.before.drawn, 0.02
    speed = drawn.mean_rate * float(params.robot.step_length) / np.pi
    mass = float(params.robot.total_mass) * drawn.mass + drawn.payload
    missed = np.abs(info["walking_speed"] - speed) / speed
    energy = info["positive_work"] + info["copper_loss"]
    weights = {name: float(getattr(params, name)) for name in WEIGHTS}
    tracking = weights["tracking_weight"] * period * np.maximum(-1.0, 1 - missed)
    close(info["reward_tracking"], tracking)
    close(info["reward_slip"], -weights["slip_weight"] * info["slid"] / speed)
    close(info["reward_energy"], -weights["energy_weight"] * energy / (mass * 9.81 * speed))
    close(info["reward_fall"], -weights["fall_penalty"] * run.terminated)
    close(run.reward, sum(info[name] for name in TERMS))


def test_a_perfect_walk_would_earn_ten_times_the_tracking_weight_in_ten_seconds():
    env, params = task()
    run = rollout(env, replace(params, mean_rate=1e-30, tracking_weight=3.0), actions(0.1))
    missed = -run.info["reward_tracking"]  # at a speed so far off every step costs all it can
    assert missed[0, :500].sum() == pytest.approx(10 * 3.0, rel=1e-3)


def test_finishing_a_one_step_scene_is_no_fall():
    env, params = task("one")
    run = rollout(env, params, constant(0.24, 0.23, 0.3, 0.3))
    done = run.info["status"] == Status.STEP_COMPLETE
    fell = run.terminated & ~done
    assert done.any()
    assert fell.any()
    assert not run.info["reward_fall"][done].any()
    length = float(params.robot.step_length)
    np.testing.assert_allclose(run.info["episode_walked"][done], length, rtol=1e-4)
    assert np.all(run.info["reward_fall"][fell] == -5.0)


def angle_of(state) -> np.ndarray:
    return state.biped.phase + np.pi * state.biped.steps


@jax.jit
@jax.vmap
def centres_of(phase):
    """Centres of mass of the 24 bodies in the supporting foot's frame, along the floor."""
    return kinematics(task()[1].robot.params, phase).centres[:, 0]


def centre_of_mass(params, state, drawn) -> np.ndarray:
    """Its place along the floor, of the robot with the masses drawn."""
    robot = params.robot.params
    links = [int(name.rstrip("p")) - 1 for name in BODIES]
    masses = np.asarray(robot.mass, np.float64)[links] * drawn.mass[..., None]
    masses[..., BODIES.index("13")] += drawn.payload
    phase = jnp.asarray(state.biped.phase.ravel(), jnp.float32)
    centres = np.asarray(centres_of(phase), np.float64).reshape(*state.biped.phase.shape, 24)
    foothold = state.biped.steps * float(params.robot.step_length) + state.biped.foot_position
    return (masses * centres).sum(-1) / masses.sum(-1) + foothold


def test_what_was_walked_is_the_way_of_the_centre_of_mass(walks):
    params, run = walks
    inside, drawn = ~run.over, run.before.drawn
    way = centre_of_mass(params, run.state, drawn) - centre_of_mass(params, run.before, drawn)
    np.testing.assert_allclose(run.info["walked"][inside], way[inside], atol=2e-6)
    np.testing.assert_allclose(run.info["walking_speed"], run.info["walked"] / 0.02, rtol=1e-5)


def test_slide_and_work_agree_with_the_motion(walks):
    _, run = walks
    inside = ~run.over
    turned = (angle_of(run.state) - angle_of(run.before))[inside]
    shift = (run.state.biped.foot_position - run.before.biped.foot_position)[inside]
    info = jax.tree.map(lambda leaf: leaf[inside], run.info)
    assert np.all(info["slid"] >= np.abs(shift) - 1e-7)
    assert np.all(info["positive_work"] >= info["torque"] * turned - 1e-5)
    assert np.all(info["positive_work"] >= 0)
    one_way = (run.state.biped.crank_rate * run.before.biped.crank_rate)[inside] > 0.01
    work = np.maximum(info["torque"] * turned, 0)
    np.testing.assert_allclose(info["positive_work"][one_way], work[one_way], atol=2e-5)


def per_episode(run: Rollout, values: np.ndarray) -> np.ndarray:
    """Running sums that begin again after every end."""
    sums, total = np.zeros_like(values), np.zeros(len(values))
    for k in range(values.shape[1]):
        sums[:, k] = total = total + values[:, k]
        total = np.where(run.over[:, k], 0.0, total)
    return sums


def test_totals_are_sums_over_the_episode_and_begin_again(walks):
    run, info = walks[1], walks[1].info
    energy = info["positive_work"] + info["copper_loss"]
    length = per_episode(run, np.ones_like(run.reward))
    assert np.array_equal(info["episode_length"], length)
    for name, values in {
        "episode_return": run.reward,
        "episode_walked": info["walked"],
        "episode_slid": info["slid"],
        "episode_energy": energy,
    }.items():
        # good to roundings of the sum; a step's energy is itself a sum of two
        np.testing.assert_allclose(info[name], per_episode(run, values), rtol=3e-7, atol=1e-7)
    turned = info["episode_mean_rate"] * length * 0.02
    start = per_episode(run, np.zeros_like(turned)) + run.first_state.biped.phase[:, None]
    first = np.cumsum(run.over, axis=1) - run.over == 0
    angle = angle_of(run.state)
    going = first & ~run.over
    np.testing.assert_allclose(turned[going], (angle - start)[going], atol=2e-4)


def test_the_ground_pushes_inside_the_cone_of_the_friction_drawn():
    env, params = task("random")
    assert params.randomisation == RANGES
    run = doubles(rollout(env, params, actions(0.3)))
    last = run.info["final_obs"]
    mu_static, mu_kinetic, velocity = last[..., 6], last[..., 7], last[..., 3]
    friction, normal = run.info["friction_force"], run.info["normal_force"]
    inside = run.info["status"] <= 1
    assert np.all(normal[inside] > 0)
    assert np.all(np.abs(friction)[inside] <= (mu_static * normal)[inside] * (1 + 1e-5) + 1e-4)
    slides = inside & (velocity != 0)
    expected = -np.sign(velocity) * mu_kinetic * normal
    assert slides.any()
    np.testing.assert_allclose(friction[slides], expected[slides], rtol=1e-4)
    heel, toe = float(params.robot.heel), float(params.robot.toe)
    assert np.all((run.info["zmp"] > -heel - 1e-4)[inside])
    assert np.all((run.info["zmp"] < toe + 1e-4)[inside])


class Saving(BipedEnv):
    """Nothing counts but torque."""

    def reward_of(self, state, action, info, params):
        return info["torque"] * 0 - action[0] ** 2 - 0.1 * state.elapsed


@dataclass(frozen=True, eq=False)
class Odd(BipedEnv):
    """Whose reward is what is given."""

    given: Any = None

    def reward_of(self, state, action, info, params):
        return self.given


def test_a_reward_of_ones_own_is_returned_and_added_up():
    env = Saving(autoreset="disabled")
    params = env.make_params()
    state, total = env.reset(jax.random.key(0), params)[1], 0.0
    for step, action in enumerate((0.1, -0.2, 0.0)):
        given = jnp.full(1, action)
        _, state, reward, _, _, info = env.step(jax.random.key(0), state, given, params)
        total += float(reward)
        np.testing.assert_allclose(reward, -(action**2) - 0.1 * step, rtol=1e-5)
        np.testing.assert_allclose(info["episode_return"], total, rtol=1e-5)
    assert machine_of_env(env).name == "biped"
    stepped = partial(jax.eval_shape, state=state, action=jnp.zeros(1), params=params)
    assert stepped(Odd(given=True).step_env)[2].dtype == state.biped.phase.dtype
    for given in (None, (1.0, 2.0)):
        with pytest.raises(ValueError, match=r"reward_of gave .*; accepted: a number"):
            stepped(Odd(given=given).step_env)
