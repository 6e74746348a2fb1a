"""The environment in MuJoCo: MuJoCo's motion, the package's observation and reward."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

pytest.importorskip("mujoco")

from stickslip.agents.exchange.files import mechanism
from stickslip.agents.exchange.mujoco_env import MujocoBiped, engine_of, friction_at
from stickslip.cli import OK, WRONG_INPUT, main
from stickslip.dynamics import Scene
from stickslip.dynamics.biped.model import loaded_params
from stickslip.dynamics.status import Status
from stickslip.envs.biped.env import BipedEnv
from stickslip.envs.biped.params import Randomisation
from stickslip.envs.biped.state import drawn_robot

KEY = jax.random.key(0)
START = Randomisation(phase=(2.0, 2.0), crank_rate=(3.0, 3.0))
"""In the middle of a step at 3 rad/s."""


def walked(env, params, torque: float, steps: int):
    """Rows of observation, reward and info, and the last state."""
    obs, state = env.reset(KEY, params)
    rows = []
    for _ in range(steps):
        obs, state, reward, over, _, info = env.step(KEY, state, [torque], params)
        rows.append((np.asarray(obs), float(reward), jax.tree.map(np.asarray, info)))
        if over:
            break
    return rows, state


def test_half_a_step_has_the_observations_and_rewards_of_the_package():
    params = BipedEnv().make_params(scene=Scene.uniform(0.5), randomisation=START)
    ours, _ = walked(BipedEnv(autoreset="disabled"), params, 0.1, 25)
    theirs, _ = walked(MujocoBiped(autoreset="disabled"), params, 0.1, 25)
    assert len(ours) == len(theirs) == 25
    for (obs, reward, info), (seen, earned, told) in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(seen, obs, atol=0.02)
        assert earned == pytest.approx(reward, abs=2e-4)
        assert told["positive_work"] == pytest.approx(info["positive_work"], abs=2e-4)
        assert told["normal_force"] == pytest.approx(info["normal_force"], rel=0.02)
        assert told["zmp"] == pytest.approx(info["zmp"], abs=0.01)


def test_a_step_is_a_function_of_its_arguments_in_a_batch_too():
    env, params = MujocoBiped(), BipedEnv().make_params(randomisation=START)
    torques = jnp.array([[-0.3], [0.5]])

    def walk(torque):
        _, state = env.reset_env(KEY, params)
        for _ in range(3):
            _, state, *_ = env.step_env(state, torque, params)
        return state

    walks = jax.jit(jax.vmap(walk))
    batch, reverse = walks(torques), walks(torques[::-1])
    np.testing.assert_array_equal(batch.engine, reverse.engine[::-1])
    np.testing.assert_allclose(batch.biped.time, 0.06, rtol=1e-6)
    assert float(batch.biped.crank_rate[1] - batch.biped.crank_rate[0]) > 0.1


def test_a_slippery_floor_limits_the_force_and_the_foot_slides():
    scene = Scene.patches([1.0], [0.02, 0.5])  # the foot stands on the first
    params = BipedEnv().make_params(scene=scene, randomisation=START)
    rows, state = walked(MujocoBiped(autoreset="disabled"), params, 0.5, 8)
    last = rows[-1][2]
    assert abs(last["friction_force"]) == pytest.approx(0.02 * last["normal_force"], rel=0.01)
    assert rows[-1][0][4] == 0.0  # not sticking
    assert abs(float(state.biped.foot_position)) > 1e-3
    assert float(state.totals.slid) == pytest.approx(abs(float(state.biped.foot_position)), rel=0.1)
    floor = jax.tree.map(np.asarray, scene.floor)
    assert [friction_at(floor, x) for x in (0.9, 1.1)] == pytest.approx([0.02, 0.5])


def test_the_swinging_foot_s_heel_strikes_the_floor_unless_it_has_no_contact():
    near = replace(START, phase=(4.2, 4.2))
    params = BipedEnv().make_params(scene=Scene.uniform(0.5), randomisation=near)
    free, _ = walked(MujocoBiped(autoreset="disabled", swing_contact=False), params, 0.0, 5)
    struck, _ = walked(MujocoBiped(autoreset="disabled"), params, 0.0, 5)
    assert free[-1][0][2] - struck[-1][0][2] > 0.3  # crank rates [rad/s]
    ours, _ = walked(BipedEnv(autoreset="disabled"), params, 0.0, 5)
    np.testing.assert_allclose(free[-1][0], ours[-1][0], atol=0.03)


def test_drawn_masses_and_friction_are_mujocos():
    drawn = replace(START, mass=(1.2, 1.5), payload=(1.0, 3.0), friction=(0.5, 0.9))
    params = BipedEnv().make_params(randomisation=drawn)
    _, state = MujocoBiped().reset(KEY, params)
    robot = drawn_robot(state.drawn, params)
    engine = engine_of(jax.tree.map(np.asarray, mechanism(loaded_params(robot))))
    assert engine.model.body_mass.sum() == pytest.approx(float(robot.total_mass), rel=1e-6)
    assert float(robot.total_mass) > 10.0


def test_a_biped_that_is_thrown_over_has_toppled_and_one_that_races_has_run_away():
    params = BipedEnv().make_params(scene=Scene.uniform(1.0), torque_limit=40.0)
    _, state = walked(MujocoBiped(autoreset="disabled"), params, -1.0, 100)
    assert bool(state.over)
    rows, _ = walked(MujocoBiped(autoreset="disabled"), params.replace(max_crank_rate=1.0), 1.0, 9)
    assert rows[-1][2]["status"] == Status.RUNAWAY


@pytest.mark.long
def test_the_command_evaluates_a_policy_and_refuses_a_vehicle_s(capsys):
    assert main(["evaluate", "biped-stop", "--in", "mujoco", "--episodes", "1"]) == OK
    assert "BipedStop-v0  biped-stop" in capsys.readouterr().out
    assert main(["evaluate", "ugv-bump", "--in", "mujoco"]) == WRONG_INPUT
    assert "accepted: none, or the biped" in capsys.readouterr().err


def test_a_motor_s_power_limits_its_torque_in_mujoco_too():
    params = BipedEnv().make_params(scene=Scene.uniform(0.5), max_power=2.0, randomisation=START)
    ours, _ = walked(BipedEnv(autoreset="disabled"), params, 1.0, 3)
    theirs, _ = walked(MujocoBiped(autoreset="disabled"), params, 1.0, 3)
    for (*_, info), (*_, told) in zip(ours, theirs, strict=True):
        assert told["torque"] == pytest.approx(info["torque"], rel=0.01)
        assert told["positive_work"] == pytest.approx(info["positive_work"], rel=0.01)
        assert told["torque"] < 0.7
