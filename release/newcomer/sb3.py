"""Stable-Baselines3 trains; the policy is kept, does the same, and is scored."""

import sys

from stable_baselines3 import PPO

from stickslip.agents import from_sb3, load_policy, save_policy
from stickslip.cli import main
from stickslip.envs import SB3VecEnv, task_by_name

env, params = task_by_name("BipedSteady-v0").make("same_step")
model = PPO("MlpPolicy", SB3VecEnv(env, params, num_envs=4), n_steps=32, batch_size=64, seed=0)
model.learn(total_timesteps=256)
save_policy(from_sb3(model), "mine.npz")
obs = SB3VecEnv(env, params, num_envs=1, seed=3).reset()
theirs, _ = model.predict(obs, deterministic=True)
if abs(load_policy("mine.npz")(obs[0]) - theirs[0]).max() > 1e-5:
    sys.exit("the policy that was saved does something else than the model")
if main(["evaluate", "mine.npz", "crank-speed-pi", "--episodes", "2"]):
    sys.exit("evaluation failed")
