"""The UGV in every adapter: the same seed is the same sequence of episodes everywhere."""

from __future__ import annotations

import warnings
from functools import lru_cache

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from stickslip.envs import GymEnv
from tests.envs.same_as_single import check_vector_env
from tests.envs.ugv.helpers import UGV, actions, drive, make, make_vec, task
from tests.extras import SB3

pytestmark = pytest.mark.long

SEED, SEEN = 5, 60
"""Steps compared: several episodes."""
TOLERANCE = {"rtol": 1e-3, "atol": 2e-3}


@lru_cache
def by_hand(seed: int):
    env, params = task("random", autoreset="same_step", preview=3)
    run = drive(env, params, actions(SEEN, seed, 0.5), seed)
    assert run.over.sum() >= 3
    return run


def close(given, expected):
    np.testing.assert_allclose(given, expected, **TOLERANCE)


@pytest.mark.parametrize("seed", [SEED, SEED + 1])
def test_the_single_environment_does_what_the_functional_one_does(seed):
    run, env = by_hand(seed), make()
    obs, _ = env.reset(seed=seed)
    close(obs, run.first_obs)
    for k, action in enumerate(actions(SEEN, seed, 0.5)):
        obs, reward, terminated, truncated, info = env.step(action)
        close(obs, run.info["final_obs"][k])
        close(reward, run.reward[k])
        assert (terminated, truncated) == (run.terminated[k], run.truncated[k])
        assert set(info) == set(run.info) - {"final_obs", "autoreset"}
        if terminated or truncated:
            close(env.reset()[0], run.obs[k])
    assert run.terminated.any()


@SB3
def test_the_stable_baselines3_environment_too():
    from stickslip.envs.adapters.sb3 import SB3VecEnv

    env_params = task("random", autoreset="same_step", preview=3)
    env, runs = SB3VecEnv(*env_params, 2, seed=SEED), [by_hand(SEED), by_hand(SEED + 1)]
    given = np.stack([actions(SEEN, SEED + i, 0.5) for i in range(2)], axis=1)
    close(env.reset(), [run.first_obs for run in runs])
    for k in range(SEEN):
        obs, reward, done, infos = env.step(given[k])
        for i, run in enumerate(runs):
            close(obs[i], run.obs[k])
            close(reward[i], run.reward[k])
            assert done[i] == run.over[k]
            if done[i]:
                close(infos[i]["terminal_observation"], run.info["final_obs"][k])
                assert infos[i]["TimeLimit.truncated"] == run.truncated[k]


@pytest.mark.parametrize(
    "mode",
    [
        "same_step",
        pytest.param("next_step", marks=pytest.mark.long),
        pytest.param("disabled", marks=pytest.mark.long),
    ],
)
def test_the_vector_environment_does_what_single_ones_do(mode):
    envs = make_vec(3, mode)
    ended = check_vector_env(envs, make, steps=40, seed=SEED, scale=0.5, rtol=1e-3, atol=2e-3)
    assert ended >= 3
    envs.close()


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


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"speeed": 1}, r"unknown option among \['speeed'\]; accepted: those of UGVEnv"),
        ({"criterion": "speed"}, r"criterion = 'speed'"),
        ({"friction": -1.0}, r"friction = -1\.0"),
        ({"autoreset": "same_step"}, r"autoreset = 'same_step'; accepted: 'disabled'"),
    ],
)
def test_bad_options_of_make_are_named(options, message):
    with pytest.raises(ValueError, match=message):
        gymnasium.make(UGV, **options)
    if "autoreset" in options:
        with pytest.raises(ValueError, match="accepted: autoreset_mode"):
            gymnasium.make_vec(UGV, vectorization_mode="vector_entry_point", **options)
