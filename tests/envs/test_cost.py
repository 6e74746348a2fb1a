"""info["cost"]: what it is, and the same in every adapter."""

import gymnasium
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from gymnasium.wrappers import RecordEpisodeStatistics, TimeAwareObservation

from stickslip.dynamics import Scene
from stickslip.envs import TASKS, BipedEnv, GymEnv, GymnaxEnv, GymVectorEnv, UGVEnv

ENV = BipedEnv(autoreset="disabled")
PUSH = np.asarray([0.25], np.float32)


@pytest.fixture(scope="module")
def slides():
    """Infos of an episode that slides, and the foot's position before and after each step."""
    params = ENV.make_params(scene=Scene.uniform(0.02, 0.015))
    infos, (_, state) = [], ENV.reset(jax.random.key(0), params)
    feet = [float(state.biped.foot_position)]
    while not state.over:
        _, state, *_, info = ENV.step(jax.random.key(0), state, PUSH, params)
        infos.append({name: float(info[name]) for name in ("cost", "status", "reward_fall")})
        feet.append(float(state.biped.foot_position))
    return infos, np.asarray(feet), params


def test_the_cost_is_the_way_of_the_foot_over_the_floor_and_one_more_at_a_fall(slides):
    infos, feet, _ = slides
    cost, moved = np.asarray([one["cost"] for one in infos]), np.abs(np.diff(feet))
    assert infos[-1]["reward_fall"] < 0
    cost[-1] -= 1.0
    assert moved.sum() > 0.05
    np.testing.assert_allclose(cost, moved, atol=1e-6)
    assert all(one["reward_fall"] == 0 for one in infos[:-1])


def test_every_adapter_tells_the_same_cost(slides):
    infos, _, params = slides
    one, many = GymEnv(ENV, params), GymVectorEnv(ENV, params, 2)
    gymnax = GymnaxEnv(BipedEnv(), params)
    state = gymnax.reset(jax.random.key(0))[1]
    one.reset(), many.reset()
    for info in infos:
        told = one.step(PUSH)[4]["cost"]
        assert type(told) is float
        _, state, *_, last = gymnax.step(jax.random.key(0), state, jnp.asarray(PUSH))
        every = [told, float(last["cost"]), *many.step(np.tile(PUSH, (2, 1)))[4]["cost"]]
        np.testing.assert_allclose(every, info["cost"], atol=1e-6)


def test_a_vehicles_step_costs_one_where_it_fails():
    env, costs = UGVEnv(autoreset="disabled"), []
    params = env.make_params(friction=0.02)
    _, state = env.reset(jax.random.key(0), params)
    while not state.over:
        _, state, *_, info = env.step(jax.random.key(0), state, [0.0, 0.0], params)
        costs.append(float(info["cost"]))
    assert info["status"] != 0
    assert costs == [*[0.0] * (len(costs) - 1), 1.0]


def test_an_environment_tells_its_cost_limit_through_wrappers():
    name = "BipedSprintSafe-v0"
    env = gymnasium.make(f"stickslip/{name}")
    wrapped = TimeAwareObservation(RecordEpisodeStatistics(env))
    assert wrapped.get_wrapper_attr("cost_limit") == env.unwrapped.cost_limit == 0.05
    assert TASKS[name].cost_limit == gymnasium.make_vec(env.spec.id).cost_limit == 0.05
    assert gymnasium.make("stickslip/Biped-v0").get_wrapper_attr("cost_limit") is None
    own = gymnasium.make("stickslip/Biped-v0", cost_limit=0.2)
    assert own.get_wrapper_attr("cost_limit") == pytest.approx(0.2)
    assert gymnasium.make("stickslip/UGV-v0").get_wrapper_attr("cost_limit") is None
    with pytest.raises(ValueError, match=r"cost_limit = -1\.0 .*a finite cost >= 0"):
        BipedEnv().make_params(cost_limit=-1.0)
