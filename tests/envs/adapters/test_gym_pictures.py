"""The Gymnasium environment's pictures: of the present state, in every render mode."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from stickslip.envs import GymEnv
from tests.envs.helpers import make
from tests.envs.toy import Toy, ToyParams


def toy(**more: Any) -> GymEnv:
    return GymEnv(Toy("disabled"), ToyParams(), **more)


@pytest.mark.parametrize("mode", [pytest.param(None, marks=pytest.mark.long), "rgb_array"])
def test_check_env_finds_nothing_to_complain_about_in_its_pictures(mode):
    pytest.importorskip("matplotlib")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make(render_mode=mode))


@pytest.mark.parametrize("mode", ["ansi", "rgb", "", 3])
def test_an_unknown_render_mode_is_refused_with_the_known_ones(mode):
    with pytest.raises(ValueError, match=r"render_mode = .*None, 'human', 'rgb_array'"):
        toy(render_mode=mode)


def test_a_picture_is_of_the_present_state_and_a_reset_clears_the_history():
    env = toy(render_mode="rgb_array")
    with pytest.raises(ValueError, match=r"render without an episode; accepted: after reset"):
        env.render()
    env.reset(seed=0)
    assert env.render().max() == 0
    env.step(np.zeros(2))
    assert env.render().max() == 30
    env.reset()
    assert env.render().max() == 0
    assert env._renderer.resets == 1


def test_rendering_without_a_mode_warns_and_draws_nothing():
    env = toy()
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None


def test_an_episode_can_be_watched_without_a_display():
    pytest.importorskip("pygame")
    env = toy(render_mode="human")
    env.reset(seed=0)
    for _ in range(2):
        env.step(np.zeros(2))
    assert env._window.is_open
    env.close()
    env.close()


def test_the_frame_rate_is_that_of_the_control_steps():
    assert toy().metadata["render_fps"] == 10
    assert make().metadata["render_fps"] == 50
    assert make(control_period=0.05).metadata["render_fps"] == 20
    assert GymEnv.metadata["render_fps"] == 50
