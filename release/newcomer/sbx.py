"""sbx's PPO, in JAX, on the environments for Stable-Baselines3."""

import sys

from sbx import PPO

from stickslip.envs import SB3VecEnv, task_by_name

env, params = task_by_name("BipedSteady-v0").make("same_step")
envs = SB3VecEnv(env, params, num_envs=4)
model = PPO("MlpPolicy", envs, n_steps=32, batch_size=64, seed=0)
model.learn(total_timesteps=256)
action, _ = model.predict(envs.reset(), deterministic=True)
if action.shape != (4, 1) or not (abs(action) <= 1).all():
    sys.exit(f"actions are {action}")
