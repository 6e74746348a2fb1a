"""The Gymnasium environment's pictures: of the present state, in every render mode."""

from __future__ import annotations

import copy
import pickle
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from stickslip.envs import GymEnv, GymVectorEnv
from tests.envs.helpers import BIPED, make
from tests.envs.toy import Toy, ToyParams, one_toy


@pytest.mark.parametrize("mode", [pytest.param(None, marks=pytest.mark.long), "rgb_array"])
def test_check_env_finds_nothing_to_complain_about_in_its_pictures(mode):
    pytest.importorskip("matplotlib")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make(render_mode=mode))


def test_a_picture_is_of_the_present_state():
    env = one_toy(render_mode="rgb_array")
    with pytest.raises(ValueError, match=r"render without an episode; accepted: after reset"):
        env.render()
    env.reset(seed=0)
    assert env.render().max() == 0
    env.step(np.zeros(2))
    assert env.render().max() == 30
    env.reset()
    assert env.render().max() == 0


def test_rendering_without_a_mode_warns_and_draws_nothing():
    env = one_toy()
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None


def test_an_episode_can_be_watched_without_a_display():
    pytest.importorskip("pygame")
    with pytest.warns(UserWarning, match="HumanRendering wrapper is being applied"):
        env = gymnasium.make(BIPED, render_mode="human")
    env.reset(seed=0)
    for _ in range(2):
        env.step(np.zeros(1))
    assert env.get_wrapper_attr("window") is not None
    env.close()


def many() -> GymVectorEnv:
    return GymVectorEnv(Toy(), ToyParams(), 2, render_mode="rgb_array")


def sb3() -> Any:
    pytest.importorskip("stable_baselines3")
    from stickslip.envs.adapters.sb3 import SB3VecEnv

    return SB3VecEnv(Toy(), ToyParams(), 2, render_mode="rgb_array")


def drawn(name: str) -> gymnasium.Env:
    pytest.importorskip("matplotlib")
    return gymnasium.make(name, render_mode="rgb_array")


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
@pytest.mark.parametrize(
    "build",
    [
        lambda: one_toy(render_mode="rgb_array"),
        many,
        sb3,
        lambda: drawn(BIPED),
        pytest.param(lambda: drawn("stickslip/UGV-v0"), marks=pytest.mark.long),
    ],
)
def test_a_rendered_environment_is_copied(build, copied):
    env = build()
    for _ in range(2):
        env.reset()
        env.render()
        other, action = copied(env), np.zeros(env.action_space.shape)
        if build in (many, sb3):
            action = np.zeros((2, 2))
        np.testing.assert_array_equal(env.step(action)[0], other.step(action)[0])
        np.testing.assert_array_equal(env.render(), other.render())
    env.close()


def test_the_frame_rate_is_that_of_the_control_steps():
    assert one_toy().metadata["render_fps"] == 10
    assert make().metadata["render_fps"] == 50
    assert make(control_period=0.05).metadata["render_fps"] == 20
    assert GymEnv.metadata["render_fps"] == 50
