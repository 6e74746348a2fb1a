"""Stable-Baselines3 over single environments, as its make_vec_env puts them side by side."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import SubprocVecEnv, VecNormalize

import stickslip  # noqa: F401  (registers the environments)
from tests.envs.adapters.tiny import BIPED, IDLE, LEARNT, hurry
from tests.extras import SB3

pytestmark = SB3


def test_its_checker_has_no_complaint():
    check_env(gymnasium.make(BIPED, **hurry()))


def test_ppo_learns_over_make_vec_env():
    torch.set_num_threads(1)
    envs = make_vec_env(BIPED, n_envs=4, seed=0, env_kwargs=hurry())
    model = PPO("MlpPolicy", envs, 5e-3, n_steps=128, batch_size=256, gamma=0.9, seed=0)
    before = evaluate_policy(model, envs, n_eval_episodes=40)[0]
    model.learn(3_000)
    after = evaluate_policy(model, envs, n_eval_episodes=40)[0]
    assert before == pytest.approx(IDLE, abs=0.02)
    assert after > LEARNT


def test_its_episodes_end_by_time_where_ours_do():
    envs = make_vec_env(BIPED, n_envs=2, seed=3, env_kwargs=hurry())
    envs.reset()
    for _ in range(15):
        _, _, dones, infos = envs.step(np.zeros((2, 1), np.float32))
    assert dones.all()
    for info in infos:
        assert info["TimeLimit.truncated"]
        assert info["episode"]["l"] == 15
        assert info["episode"]["r"] == pytest.approx(info["episode_return"], abs=1e-4)


@pytest.mark.long
def test_ppo_learns_over_processes_with_normalised_observations():
    envs = VecNormalize(
        make_vec_env(BIPED, 2, seed=0, env_kwargs=hurry(), vec_env_cls=SubprocVecEnv)
    )
    try:
        model = PPO("MlpPolicy", envs, 3e-3, n_steps=256, batch_size=128, gamma=0.9, seed=0)
        model.learn(6_000)
        envs.training, envs.norm_reward = False, False
        assert evaluate_policy(model, envs, n_eval_episodes=40)[0] > LEARNT
    finally:
        envs.close()
