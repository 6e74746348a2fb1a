"""The Stable-Baselines3 vector environment keeps Stable-Baselines3's contract."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecMonitor

from stickslip.dynamics import Scene
from stickslip.envs import BipedEnv, GymVectorEnv
from stickslip.envs.adapters.sb3 import SB3VecEnv
from tests.envs.toy import PARAMS, Toy, pushes
from tests.extras import SB3

pytestmark = SB3


def toys(count: int = 3, **more) -> SB3VecEnv:
    return SB3VecEnv(Toy("same_step"), PARAMS, count, **more)


def test_arrays_are_fresh_writable_and_of_the_types_expected():
    env = toys()
    first = env.reset()
    assert (first.dtype, first.shape) == (np.float32, (3, 2))
    results = [env.step(pushes(3)) for _ in range(2)]
    for obs, reward, done, infos in results:
        assert (obs.dtype, obs.shape) == (np.float32, (3, 2))
        assert (reward.dtype, reward.shape) == (np.float32, (3,))
        assert (done.dtype, done.shape) == (np.bool_, (3,))
        assert [type(info) for info in infos] == [dict] * 3
        for array in (first, obs, reward, done):
            assert array.flags.writeable
    for one, other in zip(*(result[:3] for result in results), strict=True):
        assert not np.shares_memory(one, other)
    results[1][0][:] = 99.0
    assert env.step(pushes(3))[0][0, 1] == 3


def test_the_last_observation_and_the_reason_of_the_end_are_kept():
    env = toys(2)
    env.reset()
    for step in range(1, PARAMS.limit + 1):
        obs, _, done, infos = env.step(pushes(2))
        if step < PARAMS.limit:
            assert not done.any()
            assert infos == [{}, {}]
            last = obs
    assert done.all()
    for i, info in enumerate(infos):
        assert info["TimeLimit.truncated"] is True
        assert info["terminal_observation"].dtype == np.float32
        assert info["terminal_observation"].tolist() == [last[i, 0], PARAMS.limit]
        assert obs[i, 1] == 0
        assert obs[i, 0] != last[i, 0]
        assert type(info["right"]) is bool
        assert type(info["place"]) is float


def test_every_info_holds_the_cost_of_its_step():
    env, push = BipedEnv(), np.full((2, 1), 0.25, np.float32)
    params = env.make_params(scene=Scene.uniform(0.02, 0.015))
    stable, vector = SB3VecEnv(env, params, 2), GymVectorEnv(env, params, 2, "same_step")
    stable.reset(), vector.reset()
    for _ in range(20):
        infos = stable.step(push)[3]
        assert [info["cost"] for info in infos] == vector.step(push)[4]["cost"].tolist()
    assert infos[0]["cost"] > 0


def test_seeds_are_counted_up_and_go_on_until_seeded_again():
    firsts = toys(3, seed=5).reset()[:, 0]
    assert firsts[1] == toys(1, seed=6).reset()[0, 0]
    env = toys(3, seed=5)
    assert np.array_equal(env.reset()[:, 0], firsts)
    second = env.reset()[:, 0]
    assert not set(second) & set(firsts)
    with pytest.raises(ValueError, match="seed = -1"):
        env.seed(-1)
    env.seed(5)
    assert np.array_equal(env.reset()[:, 0], firsts)
    assert np.array_equal(env.reset()[:, 0], second)


def test_attributes_are_reached():
    env = toys()
    assert env.get_attr("render_mode") == [None] * 3
    assert env.get_attr("num_envs", indices=[0, 2]) == [3, 3]
    assert env.get_attr("limit") == [PARAMS.limit] * 3
    assert env.get_attr("action_names", 1) == [("push", "idle")]
    assert env.get_attr("params") == [PARAMS] * 3
    assert env.has_attr("functional")
    assert not env.has_attr("spee")
    with pytest.raises(AttributeError, match=r"'spee'; accepted: those of SB3VecEnv, ToyParams"):
        env.get_attr("spee")
    assert env.env_method("parameter_names", indices=[1]) == [()]
    assert env.env_method("observation_bounds", PARAMS)[2][0].tolist() == [-2.0, 0.0]
    with pytest.raises(AttributeError, match=r"no method 'x'; accepted: those of"):
        env.env_method("x")
    env.close()


def test_attributes_that_are_compiled_in_are_not_set():
    with pytest.raises(ValueError, match=r"'limit' cannot be set; accepted: set_options"):
        toys().set_attr("limit", 1)
    with pytest.raises(ValueError, match=r"render_mode = 'human' is unknown; accepted: None, 'rgb"):
        toys(render_mode="human")


def test_every_environment_has_a_picture_and_render_shows_them_in_one():
    env = toys(4, render_mode="rgb_array")
    assert env.render_mode == "rgb_array"
    with pytest.raises(ValueError, match="render without an episode"):
        env.get_images()
    env.reset()
    env.step(pushes(4))
    images = env.get_images()
    assert [image.shape for image in images] == [(4, 6, 3)] * 4
    assert all((image == 30).all() for image in images)
    whole = env.render("rgb_array")
    assert whole.shape == (8, 12, 3)
    assert np.array_equal(whole, env.render())
    with pytest.warns(UserWarning, match="render_mode"):
        assert toys().render() is None
    assert toys().get_images() == [None] * 3


def test_its_statistics_are_taken_for_monitors_without_a_warning():
    class Still:
        def predict(self, obs, state=None, **_):
            return np.zeros((len(obs), 2), np.float32), state

    env = toys(3)
    assert env.env_is_wrapped(Monitor) == [True] * 3
    assert env.env_is_wrapped(VecMonitor, [0]) == [False]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rewards, lengths = evaluate_policy(Still(), env, 5, return_episode_rewards=True)
    starts = toys(3).reset()[:, 0]
    assert lengths == [PARAMS.limit] * 5
    for reward, start in zip(rewards[:3], starts, strict=True):
        assert reward == pytest.approx(PARAMS.limit * start, rel=1e-5, abs=1e-6)
