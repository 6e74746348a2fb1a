"""The baselines: how they walk, where they slip, and that they are pure."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.agents import ComputedTorque, GaitTable, OptimalGait, gaits_of
from stickslip.agents.biped import controllers
from stickslip.agents.biped.machine import BipedMachine
from stickslip.agents.evaluation.rollout import episode_key, horizon, rollout
from stickslip.agents.machine import machine_of_env
from stickslip.agents.protocol import Controller
from stickslip.dynamics import Scene, Status
from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START, BipedParams
from stickslip.envs import BipedEnv
from stickslip.envs.biped.params import Randomisation

ENV = BipedEnv()
QUICK = ("constant-torque", "crank-speed-pi", "computed-torque")
"""The others solve for gaits."""


def walk_on(controller: Any, params: Any, mu_static: list[float], mu_kinetic: list[float]) -> Any:
    """One episode on each floor, from rest at pi/2."""

    def one(still: jax.Array, sliding: jax.Array) -> Any:
        own = params.replace(scene=Scene.uniform(still, sliding))
        return rollout(ENV, controller, own, episode_key(0), horizon(params))

    return jax.vmap(one)(jnp.asarray(mu_static), jnp.asarray(mu_kinetic))


def friction_need(played: Any) -> np.ndarray:
    return np.abs(played.info["friction_force"] / played.info["normal_force"])


@pytest.mark.long
def test_computed_torque_walks_on_a_slippery_floor_without_sliding():
    played = walk_on(ComputedTorque(), ENV.default_params, [0.06, 0.05], [0.05, 0.04])
    assert not np.any(played.terminated)
    slid = np.asarray(played.info["episode_slid"])[:, -1]
    assert np.all(slid < [1e-6, 1e-4])
    need = friction_need(played)
    assert np.max(need) < 0.042, "the start relies on 0.04"
    assert np.max(need[:, 50:]) < 0.025, "steady walking needs only what the held torque costs"
    assert np.max(np.abs(played.info["zmp"])) < 0.8 * 0.24

    steady = np.asarray(played.state.biped.crank_angle)[:, [150, -1]]
    rate = (steady[:, 1] - steady[:, 0]) / (349 * 0.02)
    np.testing.assert_allclose(rate, 3.0, rtol=0.02)

    # Exchanges fall on control instants: just before or after one there is always a sample.
    steps = np.asarray(played.state.biped.steps)[0]
    phase = np.asarray(played.state.biped.phase)[0]
    after = np.nonzero(np.diff(steps[150:]))[0] + 150
    off = np.minimum(SUPPORT_END - phase[after], phase[after + 1] - SUPPORT_START)
    assert len(after) >= 5
    assert np.max(off) < 0.01 * 4.6 * 0.02, "within a hundredth of a control period"


@pytest.mark.long
def test_constant_crank_speed_slips_where_computed_torque_does_not():
    params = ENV.default_params
    played = walk_on(controllers.CrankSpeedPI(), params, [0.06, 0.2], [0.05, 0.2])
    assert not np.any(played.terminated)
    slippery, firm = np.asarray(played.info["episode_slid"])[:, -1]
    assert slippery > 5e-3
    assert firm == 0
    rate = np.asarray(played.state.biped.crank_rate)[1]
    np.testing.assert_allclose(rate[150:], 3.0, atol=0.45)
    need = friction_need(played)[1]
    assert 0.06 < np.max(need) < 0.1, "constant speed needs about 0.08 at 3 rad/s"


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.long] * (name not in QUICK))
        for name in BipedMachine.baselines
    ],
)
def test_memory_keeps_its_structure_and_the_action_its_shape(name, dtype):
    controller = machine_of_env(ENV).baseline(name, ENV)
    assert isinstance(controller, Controller)
    params = jax.eval_shape(lambda: ENV.make_params(dtype=dtype))
    obs, state = jax.eval_shape(ENV.reset_env, jax.random.key(0), params)
    memory = jax.eval_shape(controller.init, params, state)
    after, action = jax.eval_shape(controller.act, memory, obs, state, params)
    assert after == memory
    assert action.shape == (1,)
    assert action.dtype == dtype


def test_the_integral_does_not_wind_up():
    params = ENV.make_params(torque_limit=0.5)
    obs, state = ENV.reset(jax.random.key(0), params)
    controller = controllers.CrankSpeedPI(feed_forward=0.0, acceleration=1e3)
    act = jax.jit(controller.act)
    memory = controller.init(params, state)
    for _ in range(200):  # 4 s in which the crank is held fast
        memory, action = act(memory, obs, state, params)
    assert float(action[0]) == 1.0
    assert float(memory.integral) <= 0.5 + 1.5 * 0.02 * 3.0
    fast = replace(state, biped=replace(state.biped, crank_rate=jnp.float32(5.0)))
    _, action = act(memory, obs, fast, params)
    assert float(action[0]) < 0, "one step after the rate is too high it brakes"


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: controllers.ConstantTorque(float("nan")), "torque"),
        (lambda: controllers.CrankSpeedPI(acceleration=0.0), "acceleration"),
        (lambda: ComputedTorque(footing=1.5), "footing"),
    ],
)
def test_bad_settings_are_named(make, words):
    with pytest.raises(ValueError, match=f"{words} = .*accepted"):
        make().validate()


def test_unknown_names_list_the_known_ones():
    with pytest.raises(ValueError, match=r"'walk'.*'constant-torque', 'crank-speed-pi', 'comp"):
        machine_of_env(ENV).baseline("walk", ENV)


RATES = (2.0, 3.0, 4.0)


@pytest.fixture(scope="module")
def gaits() -> GaitTable:
    robot = BipedParams.from_bars()
    return gaits_of(robot, RATES, "energy", mu=0.045, torque_limit=3.6, steps=32)


@pytest.mark.long
def test_it_walks_from_rest_and_from_anywhere_and_comes_to_the_gaits_mean_rate(gaits: GaitTable):
    drawn = Randomisation(phase=(1.6, 4.7), crank_rate=(0.0, 4.0))
    params = ENV.make_params(
        scene=Scene.uniform(0.08, 0.07), time_limit=6.0, mean_rate=3.0, randomisation=drawn
    )
    follow = OptimalGait(gaits=gaits).validate()
    keys = jax.vmap(episode_key)(jnp.arange(6))
    played = jax.vmap(lambda key: rollout(ENV, follow, params, key, 300))(keys)
    assert not np.any(played.terminated)
    angle = np.asarray(played.state.biped.crank_angle)
    rate = (angle[:, -1] - angle[:, 150]) / ((angle.shape[1] - 1 - 150) * 0.02)
    np.testing.assert_allclose(rate, 3.0, atol=0.25)
    assert np.all(np.asarray(played.info["episode_slid"])[:, -1] < 0.01)
    assert np.all(np.asarray(played.info["status"]) <= Status.SLIP_ONSET)


def test_a_mixture_of_gaits_lies_between_them(gaits: GaitTable):
    rates = np.asarray(gaits.mean_rate)
    asked = jnp.asarray([*rates[:2], rates[:2].mean(), rates[-1], 99.0])
    _, found = jax.vmap(lambda rate: gaits.target(rate, jnp.asarray(2.2)))(asked)
    slow, fast, mixed, last, beyond = np.asarray(found)
    np.testing.assert_allclose(mixed, (slow + fast) / 2, rtol=1e-4)
    np.testing.assert_allclose(beyond, last, rtol=1e-6)


def test_robots_without_a_gait_are_refused():
    with pytest.raises(ValueError, match="no gait for any of the rates: mean_rate = 90"):
        gaits_of(BipedParams.from_bars(), [90.0], "energy", mu=0.045, torque_limit=3.6, steps=32)
