"""The UGV as Gymnasium makes and checks it."""

from __future__ import annotations

import warnings

import gymnasium
import pytest
from gymnasium.utils.env_checker import check_env

from stickslip.envs import GymEnv
from tests.envs.ugv.helpers import UGV, make

pytestmark = pytest.mark.long


@pytest.mark.parametrize("name", ["short", "random"])
def test_check_env_finds_nothing_to_complain_about(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make(name), skip_render_check=True)


def test_it_is_registered_and_passes_the_passive_checker():
    env = gymnasium.make(UGV, criterion="peak_torque", preview=0)
    assert isinstance(env.unwrapped, GymEnv)
    obs, _ = env.reset(seed=0)
    assert obs.shape == (9,)
    env.step(env.action_space.sample())
    assert env.metadata["render_fps"] == 10
    again = gymnasium.make(gymnasium.envs.registration.EnvSpec.from_json(env.spec.to_json()))  # type: ignore[union-attr]
    assert again.reset(seed=0)[0] == pytest.approx(obs)
    env.close()


@pytest.mark.parametrize("bad", [{"speeed": 1}, {"criterion": "speed"}, {"autoreset": "same_step"}])
def test_bad_options_of_make_are_named(bad):
    (name,) = bad
    with pytest.raises(ValueError, match=rf"{name}.*accepted"):
        gymnasium.make(UGV, **bad)
