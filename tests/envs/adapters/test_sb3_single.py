"""Stable-Baselines3 over single environments, as its make_vec_env puts them side by side."""

from __future__ import annotations

import gymnasium
import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

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
