"""Other libraries' checks of the Gymnasium ids, and Stable-Baselines3's PPO learning over one."""

from __future__ import annotations

from importlib.util import find_spec
from math import pi
from pathlib import Path

import gymnasium
import pytest

import stickslip  # noqa: F401  (registers the environments)
from stickslip.envs import Randomisation
from tests.extras import SB3

SETTINGS = Path(__file__).parents[3] / "docs" / "rl_zoo3.yml"
BIPED = "stickslip/Biped-v0"
HURRY = {
    "scene": "firm",
    "mean_rate": 8.0,
    "fall_penalty": 0.0,
    "slip_weight": 0.0,
    "energy_weight": 0.0,
    "randomisation": Randomisation(phase=(pi / 2, 3 * pi / 2), crank_rate=(1.0, 2.0)),
    "time_limit": 0.3,
}
"""A task that a few thousand steps show progress on: the best constant action earns 0.14."""


@SB3
def test_stable_baselines3_has_no_complaint():
    from stable_baselines3.common.env_checker import check_env

    check_env(gymnasium.make(BIPED, **HURRY))


@SB3
def test_ppo_learns_over_make_vec_env():
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.env_util import make_vec_env
    from stable_baselines3.common.evaluation import evaluate_policy

    torch.set_num_threads(1)
    envs = make_vec_env(BIPED, n_envs=4, seed=0, env_kwargs=HURRY)
    model = PPO("MlpPolicy", envs, 5e-3, n_steps=128, batch_size=256, gamma=0.9, seed=0)
    before = evaluate_policy(model, envs, n_eval_episodes=40)[0]
    model.learn(3_000)
    assert before == pytest.approx(0.072, abs=0.02)
    assert evaluate_policy(model, envs, n_eval_episodes=40)[0] > 0.105


@pytest.mark.long
@pytest.mark.skipif(find_spec("torchrl") is None, reason="TorchRL is an extra of its own")
@pytest.mark.filterwarnings("default")  # its own, of what becomes of its defaults
def test_torchrl_has_no_complaint_and_time_truncates():
    from torchrl.envs import GymWrapper
    from torchrl.envs.utils import check_env_specs

    env = GymWrapper(gymnasium.make(BIPED, **HURRY), device="cpu")
    env.set_seed(0)
    check_env_specs(env)
    rows = env.rollout(40)["next"]
    assert len(rows["done"]) == 15
    assert rows["truncated"][-1]
    assert not rows["terminated"].any()


def test_settings_of_rl_zoo3_are_of_ids_that_gymnasium_knows():
    known = pytest.importorskip("yaml").safe_load(SETTINGS.read_text(encoding="utf-8"))
    assert len(known) == 3
    for name, settings in known.items():
        assert gymnasium.spec(name) is not None
        assert settings["n_envs"] * settings["n_steps"] % settings["batch_size"] == 0
