"""info["cost"]: what it is, the same in every adapter, and its limit."""

import gymnasium
import jax
import numpy as np
import pytest
from gymnasium.wrappers import TimeAwareObservation

from stickslip.dynamics import Scene
from stickslip.envs import TASKS, BipedEnv, GymEnv, GymnaxEnv, GymVectorEnv, UGVEnv

KEY, PUSH = jax.random.key(0), np.asarray([0.25], np.float32)


def test_the_cost_is_the_way_of_the_foot_and_1_at_a_fall_in_every_adapter():
    env = BipedEnv(autoreset="disabled")
    params = env.make_params(scene=Scene.uniform(0.02, 0.015))
    one, many = GymEnv(env, params), GymVectorEnv(env, params, 2)
    gymnax = GymnaxEnv(BipedEnv(), params)
    one.reset(), many.reset()
    before, inner, way = env.reset(KEY, params)[1], gymnax.reset(KEY)[1], 0.0
    while not before.over:
        _, after, *_, info = env.step(KEY, before, PUSH, params)
        slid = abs(float(after.biped.foot_position - before.biped.foot_position))
        falls, way, before = float(info["reward_fall"] < 0), way + slid, after
        told = one.step(PUSH)[4]["cost"]
        _, inner, *_, last = gymnax.step(KEY, inner, PUSH)
        every = [info["cost"], told, last["cost"], *many.step(np.tile(PUSH, (2, 1)))[4]["cost"]]
        np.testing.assert_allclose(every, slid + falls, atol=1e-6)
        assert type(told) is float
    assert falls
    assert way > 0.05


def test_a_vehicles_step_costs_one_where_it_fails():
    env, costs = UGVEnv(autoreset="disabled"), []
    params = env.make_params(friction=0.02)
    _, state = env.reset(KEY, params)
    while not state.over:
        _, state, *_, info = env.step(KEY, state, [0.0, 0.0], params)
        costs.append(float(info["cost"]))
    assert info["status"] != 0
    assert costs == [*[0.0] * (len(costs) - 1), 1.0]


def test_an_environment_tells_its_cost_limit_through_wrappers():
    env = gymnasium.make("stickslip/BipedSprintSafe-v0")
    assert TimeAwareObservation(env).get_wrapper_attr("cost_limit") == 0.05
    assert TASKS["BipedSprintSafe-v0"].cost_limit == env.unwrapped.cost_limit == 0.05
    assert gymnasium.make_vec(env.spec.id).cost_limit == 0.05
    for name in ("stickslip/Biped-v0", "stickslip/UGV-v0"):
        assert gymnasium.make(name).get_wrapper_attr("cost_limit") is None
    with pytest.raises(ValueError, match=r"cost_limit = -1\.0 .*a finite cost >= 0"):
        BipedEnv().make_params(cost_limit=-1.0)
