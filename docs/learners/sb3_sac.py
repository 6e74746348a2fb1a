"""SAC of Stable-Baselines3 on SB3VecEnv.

`pip install "stickslip[sb3]"`, then `python sb3_sac.py [STEPS]`; STEPS: of all environments.
"""

import sys

import torch
from stable_baselines3 import SAC

from stickslip.agents import evaluate_task, from_sb3
from stickslip.envs import SB3VecEnv, task_by_name

TASK = "BipedSteady-v0"
STEPS = int(sys.argv[1]) if sys.argv[1:] else 200_000

torch.set_num_threads(1)
env, params = task_by_name(TASK).make("same_step")
short = params.replace(time_limit=1.5, fall_penalty=1.0)  # else it learns to stand still
model = SAC(
    "MlpPolicy",
    SB3VecEnv(env, short, num_envs=32),
    learning_rate=1e-3,
    learning_starts=2_000,
    gradient_steps=4,  # for 32 steps of an environment
    gamma=0.98,
    policy_kwargs={"net_arch": [64, 64]},
    seed=0,
)
model.learn(STEPS)

found = evaluate_task(TASK, {"sac": from_sb3(model)}).row(TASK, "sac")
print(f"score {found.metrics['task_score'].value:.3f}")
