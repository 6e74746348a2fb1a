"""The same seed is the same sequence of episodes in every adapter and by hand."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from tests.envs.helpers import STEPS, WALKERS, actions, make, make_vec, rollout, task
from tests.extras import SB3

SEED = 11
GIVEN = actions(0.25, seed=3)
SEEN = 120
"""Control steps compared: several episodes of every walker."""
TOLERANCE = {"rtol": 1e-3, "atol": 2e-3}
"""Single precision, in programs that are compiled differently."""


@lru_cache
def by_hand():
    """The functional environment with the chain of keys: split at every reset, second part used."""
    run = rollout(*task("random"), GIVEN, seed=SEED)
    ends = run.over[:, :SEEN].sum(axis=1)
    assert np.all(ends >= 3)
    assert run.terminated[:, :SEEN].any()
    assert GIVEN.shape[:2] == (WALKERS, STEPS)
    return run


def close(given, expected):
    np.testing.assert_allclose(given, expected, **TOLERANCE)


def test_the_single_environment():
    run = by_hand()
    env = make("random")
    for walker in (0, 2):
        obs, _ = env.reset(seed=SEED + walker)
        close(obs, run.first_obs[walker])
        for k in range(SEEN):
            obs, reward, terminated, truncated, info = env.step(GIVEN[walker, k])
            close(obs, run.info["final_obs"][walker, k])
            close(reward, run.reward[walker, k])
            assert terminated == run.terminated[walker, k]
            assert truncated == run.truncated[walker, k]
            for name, value in info.items():
                close(value, run.info[name][walker, k] + 0.0)
            assert set(info) == set(run.info) - {"final_obs", "autoreset"}
            if terminated or truncated:
                close(env.reset()[0], run.obs[walker, k])


@pytest.mark.parametrize("mode", ["same_step", pytest.param("disabled", marks=pytest.mark.long)])
def test_the_vector_environment(mode):
    run = by_hand()
    env = make_vec(3, mode)
    close(env.reset(seed=SEED)[0], run.first_obs[:3])
    for k in range(SEEN):
        obs, reward, terminated, truncated, infos = env.step(GIVEN[:3, k])
        over = terminated | truncated
        close(reward, run.reward[:3, k])
        assert np.array_equal(terminated, run.terminated[:3, k])
        assert np.array_equal(truncated, run.truncated[:3, k])
        if mode == "same_step":
            for i in np.flatnonzero(over):
                close(infos["final_obs"][i], run.info["final_obs"][i, k])
        elif over.any():
            close(obs, run.info["final_obs"][:3, k])
            obs, _ = env.reset(options={"reset_mask": over})
        close(obs, run.obs[:3, k])


@pytest.mark.long
def test_the_vector_environment_that_resets_a_step_later():
    run = by_hand()
    env = make_vec(3, "next_step")
    obs, _ = env.reset(seed=SEED)
    place, resets = np.zeros(3, int), np.zeros(3, bool)
    for _ in range(SEEN):
        given = np.stack([GIVEN[i, place[i]] for i in range(3)])
        obs, reward, terminated, truncated, _ = env.step(given)
        for i in range(3):
            if resets[i]:
                close(obs[i], run.obs[i, place[i] - 1])
                assert reward[i] == 0
            else:
                close(obs[i], run.info["final_obs"][i, place[i]])
                close(reward[i], run.reward[i, place[i]])
                assert terminated[i] == run.terminated[i, place[i]]
        place += ~resets
        resets = terminated | truncated


@SB3
def test_the_stable_baselines3_environment():
    from stickslip.envs.adapters.sb3 import SB3VecEnv

    run = by_hand()
    env = SB3VecEnv(*task("random"), 3, seed=SEED)
    close(env.reset(), run.first_obs[:3])
    for k in range(SEEN):
        obs, reward, done, infos = env.step(GIVEN[:3, k])
        close(obs, run.obs[:3, k])
        close(reward, run.reward[:3, k])
        assert np.array_equal(done, run.over[:3, k])
        for i in np.flatnonzero(done):
            close(infos[i]["terminal_observation"], run.info["final_obs"][i, k])
            assert infos[i]["TimeLimit.truncated"] == run.truncated[i, k]
